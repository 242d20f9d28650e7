// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna export`.

use super::CommandResult;
use clap::Args;
use lucerna::picture::write_whole_file;
use lucerna::shader::Variant;
use std::io::Write;
use std::path::PathBuf;

/// `lucerna export`.
#[derive(Args, Clone, Debug)]
pub struct ExportArguments {
    /// The shading language.
    #[arg(long, value_enum, default_value_t = Target::Wgsl)]
    target: Target,
    /// Folder to write to; created if it does not exist.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Kernels to write, by the names that `lucerna kernels` lists. Without any: all of them.
    kernels: Vec<String>,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug)]
enum Target {
    /// One self-contained WGSL file per kernel.
    Wgsl,
}

pub fn export(arguments: &ExportArguments) -> CommandResult {
    let Target::Wgsl = arguments.target;
    for name in &arguments.kernels {
        if !lucerna::kernels().iter().any(|kernel| kernel.name == name) {
            return Err(format!("no kernel `{name}`; see `lucerna kernels`").into());
        }
    }
    for kernel in lucerna::kernels() {
        if !arguments.kernels.is_empty()
            && !arguments.kernels.iter().any(|name| name == kernel.name)
        {
            continue;
        }
        let Some(wgsl) = kernel.composed else {
            // Only someone who named the kernel needs to know.
            if !arguments.kernels.is_empty() {
                eprintln!(
                    "note: the {} variant of {} is left out: naga does not write it as WGSL",
                    kernel.variant, kernel.name
                );
            }
            continue;
        };
        let folder = match kernel.variant {
            Variant::BASELINE => arguments.output.clone(),
            variant => arguments.output.join(variant.to_string()),
        };
        let file = folder.join(format!("{}.wgsl", kernel.name));
        let folder = file.parent().unwrap_or(&arguments.output);
        std::fs::create_dir_all(folder)
            .map_err(|error| format!("cannot create the folder {}: {error}", folder.display()))?;
        write_whole_file(&file, |writer| -> std::io::Result<()> {
            writer.write_all(wgsl.as_bytes())
        })
        .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
        outln!("{}", file.display())?;
    }
    Ok(())
}
