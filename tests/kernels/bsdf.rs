//! `wgsl/bsdf`.
