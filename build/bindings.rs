// SPDX-License-Identifier: MIT OR Apache-2.0
//! Generates Rust structs and constants of the WGSL, for the modules that run on wgpu.

use super::shader::{self, CheckedKernel, CheckedTree, Variant};
use quote::ToTokens;
use std::collections::BTreeSet;
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use syn::{Attribute, Item};
use wgsl_bindgen::{
    GlamWgslTypeMap, WgslBindgenOptionBuilder, WgslShaderSourceType, WgslTypeSerializeStrategy,
};

/// Writes `bindings.rs`.
pub fn generate(tree: &CheckedTree, wgsl: &Path, out: &Path) -> Result<(), Box<dyn Error>> {
    let staged = stage(tree, wgsl, out)?;
    let mut file = syn::parse_file(&generated(tree, &staged, out)?)?;
    file.items = file.items.into_iter().filter_map(|item| data_of(item, &[], tree)).collect();
    file.items.push(syn::parse_quote! { mod _root { pub use super::*; } });
    fs::write(out.join("bindings.rs"), prettyplease::unparse(&file))?;
    Ok(())
}

/// The data items of a module: structs, their constructors and plain traits, and constants. (Layouts and pipelines are
/// left to the pass layer.) The WGSL's comments become their documentation.
fn data_of(item: Item, path: &[String], tree: &CheckedTree) -> Option<Item> {
    match item {
        Item::Mod(mut module) if module.ident != "_root" => {
            let (_, items) = module.content.as_mut()?;
            let path = [path, &[module.ident.to_string()]].concat();
            let all = std::mem::take(items).into_iter();
            *items = all.filter_map(|item| data_of(item, &path, tree)).collect();
            let is_empty = items.iter().all(|item| matches!(item, Item::Use(_)));
            (!is_empty).then_some(Item::Mod(module))
        }
        Item::Struct(mut of) if !has_wgpu(&of) => {
            let text = text_of(tree, path);
            let head = format!("struct {} ", of.ident);
            document(&mut of.attrs, text, &head);
            let inside = text.find(&head).map_or("", |at| &text[at..]);
            for field in &mut of.fields {
                let name = field.ident.as_ref()?.to_string();
                document(&mut field.attrs, inside, &format!("{name}:"));
                // Padding is private.
                if name.starts_with("reserved") {
                    field.vis = syn::parse_quote! { pub(crate) };
                }
            }
            Some(Item::Struct(of))
        }
        Item::Const(mut of) if !has_wgpu(&of) => {
            document(&mut of.attrs, text_of(tree, path), &format!("const {}:", of.ident));
            Some(Item::Const(of))
        }
        // A constructor that asks for padding is no interface.
        Item::Impl(of) if !has_wgpu(&of) && !has_padding(&of) => Some(Item::Impl(of)),
        Item::Use(of) => Some(Item::Use(of)),
        _ => None,
    }
}

fn has_padding(item: &impl ToTokens) -> bool {
    item.to_token_stream().to_string().contains("reserved")
}

fn has_wgpu(item: &impl ToTokens) -> bool {
    item.to_token_stream().to_string().to_lowercase().contains("wgpu")
}

/// The WGSL from which a module of the bindings is made; empty if there is none.
fn text_of<'a>(tree: &'a CheckedTree, path: &[String]) -> &'a str {
    let source = match path {
        [first, kernel @ ..] if first == shader::KERNELS => {
            let name = kernel.join("/");
            baseline(tree).find(|kernel| kernel.name == name).map(|kernel| &kernel.source)
        }
        path => tree.library.get(&path.join("::")),
    };
    source.map_or("", |source| source.text.as_ref())
}

/// Puts the comment lines above the first line that begins with `head` before the existing attributes.
fn document(attributes: &mut Vec<Attribute>, text: &str, head: &str) {
    let lines: Vec<_> = text.lines().map(str::trim_start).collect();
    let Some(at) = lines.iter().position(|line| line.starts_with(head)) else { return };
    let above = lines[..at].iter().rev().take_while(|line| line.starts_with("///"));
    let comments: Vec<_> = above.map(|line| line.trim_start_matches('/')).collect();
    let n = comments.len();
    for line in comments {
        // Brackets in WGSL comments are units and ranges, and links name items that Rust does not have.
        let line = line.replace("[`", "`").replace("`]", "`").replace('[', "\\[");
        let line = line.replace('<', "\\<");
        attributes.insert(0, syn::parse_quote! { #[doc = #line] });
    }
    // wgsl_bindgen's text about a field's layout becomes a separate paragraph.
    if n > 0 && attributes.get(n).is_some_and(|next| next.path().is_ident("doc")) {
        attributes.insert(n, syn::parse_quote! { #[doc = ""] });
    }
}

/// Structs that the host writes but no kernel of the baseline binds, with their modules.
const HOST_STRUCTS: &[(&str, &str)] =
    &[("scene::data", "Material"), ("fields::shadow_maps", "ShadowMaps")];
/// The staged kernel that binds them.
const HOST_STRUCTS_KERNEL: &str = "host_structs";

/// Copies the tree, because wgsl_bindgen only reads files, and adds a kernel that binds [`HOST_STRUCTS`].
///
/// It also rejects bind groups with a gap, but a kernel that does not use the scene seam has no group 0. In the copy,
/// such gaps get a binding that is not used.
fn stage(tree: &CheckedTree, wgsl: &Path, out: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let staged = out.join("staged");
    super::copy_tree(wgsl, &staged)?;
    let filled = |groups: BTreeSet<u32>| -> String {
        let last = groups.last().copied().unwrap_or(0);
        (0..last)
            .filter(|group| !groups.contains(group))
            .map(|group| {
                format!("\n@group({group}) @binding(0) var<uniform> no_group_{group}x: u32;\n")
            })
            .collect()
    };
    for kernel in baseline(tree) {
        let gaps = filled(kernel.interface().bindings.iter().map(|of| of.group).collect());
        if !gaps.is_empty() {
            let file = staged.join(shader::KERNELS).join(format!("{}.wgsl", kernel.name));
            let text = fs::read_to_string(&file)?;
            fs::write(&file, text + &gaps)?;
        }
    }
    let mut text = String::new();
    for (module, name) in HOST_STRUCTS {
        writeln!(text, "#import {}::{module}::{name}", shader::ROOT)?;
    }
    for (binding, (_, name)) in HOST_STRUCTS.iter().enumerate() {
        writeln!(text, "@group(1) @binding({binding}) var<uniform> of_{binding}x: {name};")?;
    }
    text.push_str("@compute @workgroup_size(1) fn main() {\n");
    for binding in 0..HOST_STRUCTS.len() {
        writeln!(text, "    var copy_{binding}x = of_{binding}x;")?;
    }
    text.push_str("}\n@group(0) @binding(0) var<uniform> no_group_0x: u32;\n");
    let file = staged.join(shader::KERNELS).join(format!("{HOST_STRUCTS_KERNEL}.wgsl"));
    fs::write(file, text)?;
    Ok(staged)
}

/// Kernels of the baseline.
fn baseline(tree: &CheckedTree) -> impl Iterator<Item = &CheckedKernel> {
    tree.kernels.iter().filter(|kernel| kernel.variant == Variant::BASELINE)
}

/// The output of wgsl_bindgen.
fn generated(tree: &CheckedTree, tree_dir: &Path, out: &Path) -> Result<String, Box<dyn Error>> {
    let mut options = WgslBindgenOptionBuilder::default();
    options
        .workspace_root(tree_dir)
        .module_import_root(shader::ROOT)
        .serialization_strategy(WgslTypeSerializeStrategy::Bytemuck)
        .type_map(GlamWgslTypeMap)
        // The texts are already in the table of kernels.
        .shader_source_type(WgslShaderSourceType::ComposerWithRelativePath)
        .ir_capabilities(shader::BASELINE)
        .emit_rerun_if_change(false)
        .skip_hash_check(true)
        .output(out.join("bindings.rs"));
    let names = baseline(tree).map(|kernel| kernel.name.as_str());
    for name in names.chain([HOST_STRUCTS_KERNEL]) {
        let file = tree_dir.join(shader::KERNELS).join(format!("{name}.wgsl"));
        options.add_entry_point(file.to_string_lossy());
    }
    Ok(options.build()?.generate_string()?)
}
