//! `lucerna bench`.

use super::CommandResult;
use clap::Args;

/// `lucerna bench`.
#[derive(Args, Clone, Debug)]
pub struct BenchArguments {}

pub fn bench(_: &BenchArguments) -> CommandResult {
    Err("not yet".into())
}
