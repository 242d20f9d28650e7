//! Every WGSL module and kernel against oracles in f64.

mod color;
mod harness;
mod math;
mod sh;
