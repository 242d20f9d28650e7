//! `wgsl/geometry`.
