// SPDX-License-Identifier: MIT OR Apache-2.0
//! Checks every shader under `wgsl/`, generates the host bindings, and embeds the modules.
//!
//! All problems are reported together, with file, line and column; any problem fails the build.

// Also compiled into the crate, which uses the rest of it.
#[allow(dead_code, unused_imports)]
#[path = "src/shader/mod.rs"]
mod shader;

#[cfg(feature = "gpu")]
#[path = "build/bindings.rs"]
mod bindings;

use shader::{
    AXES, Access, Binding, BindingKind, CheckedKernel, CheckedTree, Dimension, RAY_QUERY, Stage,
    Texels,
};
use std::collections::BTreeMap;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, process};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=wgsl");
    println!("cargo::rerun-if-changed=src/shader");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=build");
    if cfg!(not(feature = "compose")) {
        println!("cargo::rustc-cfg=without_compose");
    }
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let out = PathBuf::from(env::var("OUT_DIR")?);

    // A relative path is easier to read in messages; cargo runs build scripts in the package's folder.
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
    copy_tree(&root.join("wgsl"), &out.join(shader::ROOT))?;
    #[cfg(feature = "gpu")]
    bindings::generate(&tree, &root.join("wgsl"), &out)?;
    fs::write(out.join("modules.rs"), modules_table(&tree, &root)?)?;
    fs::write(out.join("kernels.rs"), kernels_table(&tree, &root, &out)?)?;
    Ok(())
}

/// Makes the folder `to` a copy of `from`.
fn copy_tree(from: &Path, to: &Path) -> Result<(), Box<dyn Error>> {
    if to.exists() {
        fs::remove_dir_all(to)?;
    }
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

/// `&[Module]` of all modules that can be imported, including the overlays'.
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

/// `&[Kernel]` of all kernels in all combinations of the axes that affect them, with their composed WGSL.
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

/// A kind of binding as Rust source.
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

/// None if naga cannot write the kernel as WGSL, because of ray queries.
fn composed_wgsl(kernel: &CheckedKernel) -> Result<Option<String>, Box<dyn Error>> {
    if kernel.variant.has(RAY_QUERY) {
        return Ok(None);
    }
    let flags = naga::back::wgsl::WriterFlags::empty();
    Ok(Some(naga::back::wgsl::write_string(&kernel.composed.module, &kernel.composed.info, flags)?))
}
