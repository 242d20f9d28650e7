//! Every WGSL module and kernel against oracles in f64.

mod harness;
mod math;
mod rays;
