//! Checks every shader under `wgsl/`, generates the host bindings, and embeds the modules.
//!
//! All problems are reported together, with file, line and column; any problem fails the build.

// Compiled into the crate as well, which uses the rest of it.
#[allow(dead_code, unused_imports)]
#[path = "src/shader/mod.rs"]
mod shader;

use shader::{CheckedKernel, CheckedTree, OVERLAYS, VARIANTS, Variant};
use std::collections::BTreeSet;
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
    let tree = match shader::check_tree(Path::new("wgsl"), VARIANTS) {
        Ok(tree) => tree,
        Err(problems) => {
            for problem in &problems {
                eprintln!("{problem}\n");
            }
            eprintln!("{} problem(s) in the shaders", problems.len());
            process::exit(1);
        }
    };
    for variant in VARIANTS {
        let staged = stage(&tree, &wgsl, &out, variant)?;
        generate_bindings(&tree, &staged, &out, variant)?;
    }
    fs::write(out.join("modules.rs"), modules_table(&tree, &root)?)?;
    fs::write(out.join("kernels.rs"), kernels_table(&tree, &root, &out)?)?;
    Ok(())
}

/// Copies the tree with a variant's files in their places, for wgsl_bindgen reads only files.
///
/// It also refuses bind groups with a gap, and a kernel that asks nothing of the host seam has no
/// group 0: such gaps get a binding that nobody uses, in the copy alone. The pipeline's layout then
/// has `None` at that place.
fn stage(
    tree: &CheckedTree,
    wgsl: &Path,
    out: &Path,
    variant: &Variant,
) -> Result<PathBuf, Box<dyn Error>> {
    let staged = out.join(format!("staged{}", suffix(variant.name)));
    if staged.exists() {
        fs::remove_dir_all(&staged)?;
    }
    copy_tree(wgsl, &staged)?;
    let overlay = wgsl.join(OVERLAYS).join(variant.name);
    if !variant.name.is_empty() && overlay.exists() {
        copy_tree(&overlay, &staged)?;
    }
    for kernel in tree.kernels.iter().filter(|kernel| kernel.variant == variant.name) {
        let globals = kernel.module.global_variables.iter();
        let groups: BTreeSet<u32> =
            globals.filter_map(|(_, global)| Some(global.binding?.group)).collect();
        let Some(&last) = groups.last() else { continue };
        let gaps: String = (0..last)
            .filter(|group| !groups.contains(group))
            .map(|group| {
                format!("\n@group({group}) @binding(0) var<uniform> no_group_{group}x: u32;\n")
            })
            .collect();
        if !gaps.is_empty() {
            let file = staged.join(shader::KERNELS).join(format!("{}.wgsl", kernel.name));
            let text = fs::read_to_string(&file)?;
            fs::write(&file, text + &gaps)?;
        }
    }
    Ok(staged)
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
    variant: &Variant,
) -> Result<(), Box<dyn Error>> {
    // naga writes no ray queries as WGSL, so those kernels are composed at run time, and only
    // their layouts are taken from here.
    let source_type = if writable(variant) {
        WgslShaderSourceType::EmbedSource
    } else {
        WgslShaderSourceType::ComposerWithRelativePath
    };
    let mut options = WgslBindgenOptionBuilder::default();
    options
        .workspace_root(tree_dir)
        .module_import_root(shader::ROOT)
        .serialization_strategy(WgslTypeSerializeStrategy::Bytemuck)
        .type_map(GlamWgslTypeMap)
        .shader_source_type(source_type)
        .ir_capabilities(variant.capabilities)
        // Kernels fetch texels of 32-bit floats; baseline WebGPU does not filter those.
        .override_texture_filterability(vec![
            (r".*sky_(image|distribution)", false).into(),
            (r".*direct", false).into(),
        ])
        .emit_rerun_if_change(false)
        .skip_hash_check(true)
        .output(out.join(format!("bindings{}.rs", suffix(variant.name))));
    for kernel in tree.kernels.iter().filter(|kernel| kernel.variant == variant.name) {
        let file = tree_dir.join(shader::KERNELS).join(format!("{}.wgsl", kernel.name));
        options.add_entry_point(file.to_string_lossy());
    }
    options.build()?.generate()?;
    Ok(())
}

/// Whether naga can write the variant's kernels as WGSL.
fn writable(variant: &Variant) -> bool {
    !variant.capabilities.contains(naga::valid::Capabilities::RAY_QUERY)
}

fn suffix(variant: &str) -> String {
    if variant.is_empty() { String::new() } else { format!("_{variant}") }
}

/// `&[Module]` of all modules that can be imported, the overlays' too.
fn modules_table(tree: &CheckedTree, root: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::from("&[\n");
    let baseline = tree.library.iter().map(|source| ("", source));
    let overlays = tree.overlays.iter().map(|(variant, source)| (variant.as_str(), source));
    for (variant, source) in baseline.chain(overlays) {
        writeln!(
            text,
            "    Module {{ import_path: {:?}, variant: {variant:?}, file: {:?}, source: include_str!({:?}), imports: &{:?} }},",
            source.import_path,
            source.file,
            root.join(&source.file),
            source.imports(),
        )?;
    }
    text.push_str("]\n");
    Ok(text)
}

/// `&[Kernel]` of all kernels in all variants, with their composed WGSL.
fn kernels_table(tree: &CheckedTree, root: &Path, out: &Path) -> Result<String, Box<dyn Error>> {
    let mut text = String::from("&[\n");
    for kernel in &tree.kernels {
        let composed = match composed_wgsl(kernel)? {
            Some(wgsl) => {
                let name = format!("{}.wgsl", kernel.name);
                let file = out.join("composed").join(kernel.variant).join(name);
                fs::create_dir_all(file.parent().ok_or("no parent")?)?;
                fs::write(&file, wgsl)?;
                format!("Some(include_str!({file:?}))")
            }
            None => String::from("None"),
        };
        let r = &kernel.resources;
        writeln!(
            text,
            "    Kernel {{ name: {:?}, variant: {:?}, file: {:?}, source: include_str!({:?}), composed: {}, imports: &{:?},",
            kernel.name,
            kernel.variant,
            kernel.source.file,
            root.join(&kernel.source.file),
            composed,
            kernel.source.imports(),
        )?;
        writeln!(
            text,
            "        resources: Resources {{ storage_buffers: {}, seam_storage_buffers: {}, storage_textures: {}, sampled_textures: {}, samplers: {}, uniform_buffers: {}, workgroup_invocations: {}, workgroup_bytes: {}, texture_atomics: {} }},",
            r.storage_buffers,
            r.seam_storage_buffers,
            r.storage_textures,
            r.sampled_textures,
            r.samplers,
            r.uniform_buffers,
            r.workgroup_invocations,
            r.workgroup_bytes,
            r.texture_atomics,
        )?;
        text.push_str("        entry_points: &[");
        for entry in &kernel.module.entry_points {
            write!(
                text,
                "EntryPoint {{ name: {:?}, stage: {:?}, workgroup_size: {:?} }}, ",
                entry.name,
                format!("{:?}", entry.stage).to_lowercase(),
                entry.workgroup_size,
            )?;
        }
        text.push_str("],\n        bindings: &[\n");
        for binding in bindings_of(&kernel.module) {
            writeln!(text, "            {binding},")?;
        }
        text.push_str("        ] },\n");
    }
    text.push_str("]\n");
    Ok(text)
}

fn bindings_of(module: &naga::Module) -> Vec<String> {
    let mut rows: Vec<_> = module
        .global_variables
        .iter()
        .filter_map(|(_, variable)| {
            let binding = variable.binding?;
            // Composed names carry the module in an encoded suffix.
            let name = variable.name.as_deref().unwrap_or_default();
            let name = name.split("X_naga_oil").next().unwrap_or_default();
            let kind = match variable.space {
                naga::AddressSpace::Uniform => "uniform buffer",
                naga::AddressSpace::Storage { access }
                    if access.contains(naga::StorageAccess::STORE) =>
                {
                    "storage buffer, read and write"
                }
                naga::AddressSpace::Storage { .. } => "storage buffer, read",
                _ => match module.types[variable.ty].inner {
                    naga::TypeInner::Sampler { .. } => "sampler",
                    naga::TypeInner::AccelerationStructure { .. } => "acceleration structure",
                    naga::TypeInner::Image { class: naga::ImageClass::Storage { .. }, .. } => {
                        "storage texture"
                    }
                    _ => "texture",
                },
            };
            Some((
                binding.group,
                binding.binding,
                format!(
                    "Binding {{ group: {}, binding: {}, name: {name:?}, kind: {kind:?} }}",
                    binding.group, binding.binding
                ),
            ))
        })
        .collect();
    rows.sort();
    rows.into_iter().map(|(_, _, row)| row).collect()
}

fn composed_wgsl(kernel: &CheckedKernel) -> Result<Option<String>, Box<dyn Error>> {
    if !shader::variant(kernel.variant).is_some_and(writable) {
        return Ok(None);
    }
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::all(),
    );
    let info = validator.validate(&kernel.module)?;
    let flags = naga::back::wgsl::WriterFlags::empty();
    Ok(Some(naga::back::wgsl::write_string(&kernel.module, &info, flags)?))
}
