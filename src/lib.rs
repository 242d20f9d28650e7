//! lucerna: real-time global illumination as WGSL modules with generated host bindings.

pub mod bindings;
#[cfg(feature = "cli")]
pub mod blocking;
#[cfg(feature = "cli")]
pub mod compare;
pub mod gpu;
pub mod gpu_scene;
pub mod picture;
pub mod rays;
pub mod reference;
pub mod scene;
pub mod shader;

mod modules;

pub use modules::{
    Binding, EntryPoint, Kernel, Module, kernels, library, modules, variant_library,
};
