// SPDX-License-Identifier: MIT OR Apache-2.0
//! The `lucerna` program: its arguments, and one file for each command. See `lucerna --help`.

/// Like `println!`, but returns an error instead of panicking when the reader has closed the pipe.
macro_rules! outln {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        writeln!(std::io::stdout(), $($argument)*)
    }};
}

/// Like `eprintln!`, but ignores errors instead of panicking: a closed terminal must not end a rendering.
macro_rules! errln {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($argument)*);
    }};
}

mod bake;
mod bench;
mod compare;
mod doctor;
mod export;
mod kernels;
mod net_args;
mod progress;
mod render;
mod scene_args;
mod sheet;
mod sparse_bake;

use clap::{Parser, Subcommand};
use std::io::IsTerminal;
use std::process::ExitCode;
use tracing_subscriber::EnvFilter;

/// What a command returns: an error is printed with its causes and makes the exit code 1.
type CommandResult = Result<(), Box<dyn std::error::Error>>;

/// Real-time global illumination as WGSL modules: render, compare, inspect, export.
#[derive(Parser)]
#[command(name = "lucerna", version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Render a scene with one of the techniques.
    #[command(allow_negative_numbers = true)]
    Render(render::RenderArguments),
    /// Render a scene with the path tracer: the ground truth.
    #[command(allow_negative_numbers = true)]
    Reference(render::ReferenceArguments),
    /// Compute a technique's light once, for `render --bake`.
    Bake(bake::BakeArguments),
    /// Join the parts of a bake that `bake --shard` divided.
    Merge(sparse_bake::MergeArguments),
    /// Find the colours of the scene's lights from a picture, and render the scene with them.
    #[command(allow_negative_numbers = true)]
    FitLights(Box<render::fit_lights::FitArguments>),
    /// Measure how much a picture differs from another.
    Compare(compare::CompareArguments),
    /// Put pictures side by side, with labels and with how much each differs from the first.
    Sheet(sheet::SheetArguments),
    /// List the kernels, or describe one: bindings, workgroup size, imports.
    Kernels(kernels::KernelsArguments),
    /// Write kernels as self-contained files.
    Export(export::ExportArguments),
    /// Measure speed.
    Bench(bench::BenchArguments),
    /// Show the adapters and what each can run.
    Doctor,
}

/// Exit code 0: done; 1: the command failed; 2: the command line is wrong.
fn main() -> ExitCode {
    let arguments = Arguments::parse();
    tracing_subscriber::fmt()
        .with_env_filter(
            EnvFilter::try_from_default_env().unwrap_or_else(|_| {
                EnvFilter::new("lucerna=info,warn,wgpu_hal=error,wgpu_core=error")
            }),
        )
        .with_writer(std::io::stderr)
        // Colours are for people: a file or a pipe gets none.
        .with_ansi(std::io::stderr().is_terminal())
        .with_target(false)
        .without_time()
        .init();
    let result = match arguments.command {
        Command::Render(arguments) => render::render(&arguments),
        Command::Reference(arguments) => render::reference(&arguments),
        Command::Bake(arguments) => bake::bake(&arguments),
        Command::Merge(arguments) => sparse_bake::merge(&arguments),
        Command::FitLights(arguments) => render::fit_lights::fit(&arguments),
        Command::Compare(arguments) => compare::compare(&arguments),
        Command::Sheet(arguments) => sheet::sheet(&arguments),
        Command::Kernels(arguments) => kernels::kernels(&arguments),
        Command::Export(arguments) => export::export(&arguments),
        Command::Bench(arguments) => bench::bench(&arguments),
        Command::Doctor => doctor::doctor(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // `lucerna kernels | head`: the reader has seen enough.
        Err(error) if is_broken_pipe(error.as_ref()) => ExitCode::SUCCESS,
        Err(error) => {
            errln!("error: {error}");
            let mut cause = error.source();
            let mut last = error.to_string();
            while let Some(error) = cause {
                // Many errors already name their cause.
                if !last.contains(&error.to_string()) {
                    errln!("  because: {error}");
                }
                last = error.to_string();
                cause = error.source();
            }
            ExitCode::FAILURE
        }
    }
}

/// Whether the error comes from writing to standard output. (Errors of files name the file, and have other types.)
fn is_broken_pipe(error: &(dyn std::error::Error + 'static)) -> bool {
    let error = error.downcast_ref::<std::io::Error>();
    error.is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
}
