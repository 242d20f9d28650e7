//! Every WGSL module and kernel against oracles in f64.

mod bsdf;
mod geometry;
mod color;
mod harness;
mod light;
mod math;
mod rays;
mod sampling;
mod statistics;
mod sh;
