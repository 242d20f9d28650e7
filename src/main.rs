//! The `lucerna` program. See `lucerna --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
