// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna kernels`.

use super::CommandResult;
use clap::Args;
use lucerna::Kernel;
use lucerna::shader::Stage;
use std::io::Write;

/// `lucerna kernels`.
#[derive(Args, Clone, Debug)]
pub struct KernelsArguments {
    /// Describe this kernel, by its name in the list (like reference/path_trace).
    name: Option<String>,
    /// Print the kernel and all that it imports as one WGSL text.
    #[arg(long, requires = "name")]
    wgsl: bool,
    /// List the modules that can be imported, instead of the kernels.
    #[arg(long, conflicts_with_all = ["name", "wgsl"])]
    modules: bool,
}

pub fn kernels(arguments: &KernelsArguments) -> CommandResult {
    if arguments.modules {
        for module in lucerna::modules().iter().filter(|module| module.overlay.is_none()) {
            outln!("{:<40} {}", module.import_path, module.file)?;
        }
        return Ok(());
    }
    let Some(name) = &arguments.name else {
        outln!("{:<29} {:<42} {:>24}  bindings", "kernel", "variant", "workgroup")?;
        for kernel in lucerna::kernels() {
            let sizes: Vec<_> =
                kernel.interface.entry_points.iter().map(|e| join(e.workgroup_size)).collect();
            let (variant, n) = (kernel.variant, kernel.interface.bindings.len());
            outln!("{:<29} {variant:<42} {:>24}  {n}", kernel.name, sizes.join(" "))?;
        }
        return Ok(());
    };
    let found: Vec<_> = lucerna::kernels().iter().filter(|kernel| kernel.name == name).collect();
    let Some(first) = found.first() else {
        let names: std::collections::BTreeSet<_> =
            lucerna::kernels().iter().map(|k| k.name).collect();
        let names = Vec::from_iter(names).join(", ");
        return Err(format!("no kernel `{name}`; there is {names}").into());
    };
    if arguments.wgsl {
        let text = first.composed.unwrap_or(first.source);
        return Ok(std::io::stdout().write_all(text.as_bytes())?);
    }
    for kernel in found {
        describe(kernel)?;
    }
    Ok(())
}

fn join(size: [u32; 3]) -> String {
    size.map(|n| n.to_string()).join("x")
}

fn describe(kernel: &Kernel) -> std::io::Result<()> {
    outln!("{} ({})\n  file: {}", kernel.name, kernel.variant, kernel.file)?;
    // The header's //! lines say what the kernel does.
    for line in kernel.source.lines().filter_map(|line| line.strip_prefix("//!")) {
        outln!("  {}", line.trim())?;
    }
    for entry in kernel.interface.entry_points.iter() {
        outln!(
            "  entry point: {} ({}), workgroup {}",
            entry.name,
            match entry.stage {
                Stage::Vertex => "vertex",
                Stage::Fragment => "fragment",
                Stage::Compute => "compute",
            },
            join(entry.workgroup_size)
        )?;
    }
    let resources = &kernel.resources;
    outln!(
        "  uses: {} of 8 storage buffers ({} of the scene seam), {} textures, {} storage textures, {} bytes of workgroup memory",
        resources.storage_buffers,
        resources.seam_storage_buffers,
        resources.sampled_textures,
        resources.storage_textures,
        resources.workgroup_bytes
    )?;
    outln!("  imports: {}", kernel.imports.join(", "))?;
    outln!("  bindings:")?;
    for binding in kernel.interface.bindings.iter() {
        outln!(
            "    @group({}) @binding({}) {}: {}",
            binding.group,
            binding.binding,
            binding.name,
            binding.kind.in_words()
        )?;
    }
    outln!()
}
