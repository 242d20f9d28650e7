// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks every shader under `wgsl/`, generates the host bindings, and embeds the modules.
//!
//! All problems are reported together, with file, line and column; any problem fails the build.

// Compiled into the crate as well, which uses the rest of it.
#[allow(dead_code, unused_imports)]
#[path = "src/shader/mod.rs"]
mod shader;

use shader::{
    AXES, Access, Binding, BindingKind, CheckedKernel, CheckedTree, Dimension, RAY_QUERY, Stage,
    Texels, Variant,
};
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, process};
use wgsl_bindgen::{
    GlamWgslTypeMap, WgslBindgenOptionBuilder, WgslShaderSourceType, WgslTypeSerializeStrategy,
};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=wgsl");
    println!("cargo::rerun-if-changed=src/shader");
    println!("cargo::rerun-if-changed=build.rs");
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let wgsl = root.join("wgsl");

    // Relative names read better in messages; cargo runs build scripts in the package's folder.
    let tree = match shader::check_tree(Path::new("wgsl"), AXES) {
        Ok(tree) => tree,
        Err(problems) => {
            for problem in &problems {
                eprintln!("{problem}\n");
            }
            eprintln!("{} problem(s) in the shaders", problems.len());
            process::exit(1);
        }
    };
    let staged = stage(&tree, &wgsl, &out)?;
    generate_bindings(&tree, &staged, &out)?;
    fs::write(out.join("modules.rs"), modules_table(&tree, &root)?)?;
    fs::write(out.join("kernels.rs"), kernels_table(&tree, &root, &out)?)?;
    Ok(())
}

/// Structs that the host writes and no kernel of the baseline binds, with their modules.
const HOST_STRUCTS: &[(&str, &str)] =
    &[("scene::data", "Material"), ("fields::shadow_maps", "ShadowMaps")];
/// The staged kernel that binds them.
const HOST_STRUCTS_KERNEL: &str = "host_structs";

/// Copies the tree, for wgsl_bindgen reads only files, with a kernel that binds [`HOST_STRUCTS`].
///
/// It also refuses bind groups with a gap, and a kernel that asks nothing of the scene seam has no
/// group 0: such gaps get a binding that nobody uses, in the copy alone.
fn stage(tree: &CheckedTree, wgsl: &Path, out: &Path) -> Result<PathBuf, Box<dyn Error>> {
    let staged = out.join("staged");
    if staged.exists() {
        fs::remove_dir_all(&staged)?;
    }
    copy_tree(wgsl, &staged)?;
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

/// Kernels as the tree stands.
fn baseline(tree: &CheckedTree) -> impl Iterator<Item = &CheckedKernel> {
    tree.kernels.iter().filter(|kernel| kernel.variant == Variant::BASELINE)
}

fn copy_tree(from: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy_tree(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

fn generate_bindings(
    tree: &CheckedTree,
    tree_dir: &Path,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let mut options = WgslBindgenOptionBuilder::default();
    options
        .workspace_root(tree_dir)
        .module_import_root(shader::ROOT)
        .serialization_strategy(WgslTypeSerializeStrategy::Bytemuck)
        .type_map(GlamWgslTypeMap)
        // The texts are in the table of kernels.
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
    options.build()?.generate()?;
    Ok(())
}

/// `&[Module]` of all modules that can be imported, the overlays' too.
fn modules_table(tree: &CheckedTree, root: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::from("&[\n");
    let modules = tree.library.iter().map(|source| (None, source));
    let overlays = tree
        .overlays
        .iter()
        .map(|of| (Some((AXES[of.axis].name, AXES[of.axis].values[of.value].name)), &of.source));
    for (overlay, source) in modules.chain(overlays) {
        writeln!(
            text,
            "    Module {{ import_path: {:?}, overlay: {overlay:?}, file: {:?}, source: include_str!({:?}), imports: &{:?} }},",
            source.import_path,
            source.file,
            root.join(&source.file),
            source.imports(),
        )?;
    }
    text.push_str("]\n");
    Ok(text)
}

/// `&[Kernel]` of all kernels in all combinations of the axes that they meet, with their composed WGSL.
fn kernels_table(tree: &CheckedTree, root: &Path, out: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::from("&[\n");
    let mut files: BTreeMap<String, PathBuf> = BTreeMap::new();
    let folder = out.join("composed");
    fs::create_dir_all(&folder)?;
    for kernel in &tree.kernels {
        let composed = match composed_wgsl(kernel)? {
            Some(wgsl) => {
                let n = files.len();
                let file =
                    files.entry(wgsl.clone()).or_insert_with(|| folder.join(format!("{n}.wgsl")));
                fs::write(&*file, wgsl)?;
                format!("Some(include_str!({file:?}))")
            }
            None => String::from("None"),
        };
        writeln!(
            text,
            "    Kernel {{ name: {:?}, variant: variant_of({:?}), axes: &{:?}, file: {:?}, source: include_str!({:?}), composed: {composed}, imports: &{:?}, resources: {:?},",
            kernel.name,
            kernel.variant.to_bytes(),
            kernel.axes.iter().map(|&axis| AXES[axis].name).collect::<Vec<_>>(),
            kernel.source.file,
            root.join(&kernel.source.file),
            kernel.source.imports(),
            kernel.resources(),
        )?;
        text.push_str("        interface: Interface { entry_points: Cow::Borrowed(&[");
        for entry in kernel.interface().entry_points.iter() {
            let stage = match entry.stage {
                Stage::Vertex => "Vertex",
                Stage::Fragment => "Fragment",
                Stage::Compute => "Compute",
            };
            write!(
                text,
                "EntryPoint {{ name: Cow::Borrowed({:?}), stage: Stage::{stage}, workgroup_size: {:?} }}, ",
                entry.name, entry.workgroup_size,
            )?;
        }
        text.push_str("]), bindings: Cow::Borrowed(&[\n");
        for Binding { group, binding, name, kind } in kernel.interface().bindings.iter() {
            let kind = in_rust(kind);
            writeln!(
                text,
                "            Binding {{ group: {group}, binding: {binding}, name: Cow::Borrowed({name:?}), kind: {kind} }},"
            )?;
        }
        text.push_str("        ]) } },\n");
    }
    text.push_str("]\n");
    Ok(text)
}

/// A kind of binding as Rust writes it.
fn in_rust(kind: &BindingKind) -> String {
    let of_dimension = |dimension: &Dimension| format!("Dimension::{dimension:?}");
    match kind {
        BindingKind::Texture { dimension, texels } => {
            let texels = match texels {
                Texels::Float { filtered } => format!("Texels::Float {{ filtered: {filtered} }}"),
                other => format!("Texels::{other:?}"),
            };
            format!(
                "BindingKind::Texture {{ dimension: {}, texels: {texels} }}",
                of_dimension(dimension)
            )
        }
        BindingKind::StorageTexture { dimension, format, access } => {
            let access = match access {
                Access::Read => "Read",
                Access::Write => "Write",
                Access::ReadWrite => "ReadWrite",
            };
            format!(
                "BindingKind::StorageTexture {{ dimension: {}, format: {format:?}, access: Access::{access} }}",
                of_dimension(dimension)
            )
        }
        plain => format!("BindingKind::{plain:?}"),
    }
}

/// None where naga does not write the kernel: ray queries.
fn composed_wgsl(kernel: &CheckedKernel) -> Result<Option<String>, Box<dyn Error>> {
    if kernel.variant.has(RAY_QUERY) {
        return Ok(None);
    }
    let flags = naga::back::wgsl::WriterFlags::empty();
    Ok(Some(naga::back::wgsl::write_string(&kernel.composed.module, &kernel.composed.info, flags)?))
}
