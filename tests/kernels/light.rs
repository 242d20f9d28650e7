//! `wgsl/light`.
