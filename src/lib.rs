//! lucerna: real-time global illumination as WGSL modules with generated host bindings.

pub mod scene;
pub mod shader;
