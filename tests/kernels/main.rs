//! Every WGSL module and kernel against oracles in f64.

mod bsdf;
mod geometry;
mod harness;
mod light;
mod math;
mod sampling;
mod statistics;
