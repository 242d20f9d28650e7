// SPDX-License-Identifier: MIT OR Apache-2.0
//! lucerna: real-time global illumination as WGSL modules with generated host bindings.
//!
//! The algorithms are WGSL files under `wgsl/`. The build script checks them, composes each kernel,
//! and generates the Rust side of their structs and constants.
//!
//! # Where is what
//!
//! | to … | look at |
//! |---|---|
//! | take WGSL into a renderer of one's own | [`modules()`], [`kernels`], [`WGSL_DIR`], [`library`], [`shader`] |
//! | open a device, or wrap one that is there; call kernels | [`gpu`] |
//! | load a glTF or OBJ file, or put a scene together | [`scene`] |
//! | bring a scene to the GPU: bind group 0 of every kernel | [`gpu_scene`] |
//! | put a scene of one's own behind the techniques | [`seam`] |
//! | render frames: G-buffer, direct light, a technique's indirect light | [`frame`] |
//! | trace paths | [`techniques::reference`] |
//! | light indirectly by voxels | [`techniques::voxel_rt`], [`techniques::voxel_cone`] |
//! | build a technique | [`techniques`], [`components`] |
//! | trace many rays at once | [`rays`] |
//! | read and write PNG, EXR and HDR | [`picture`] |
//! | wait for the GPU | [`blocking`] |
//! | measure how far two pictures differ | [`compare`] |
//! | test WGSL by numbers | [`testing`] |
//!
//! # A picture
//!
//! ```
//! # #[cfg(all(feature = "gltf", feature = "vulkan"))]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use lucerna::{blocking, gpu::AdapterChoice, gpu_scene::GpuScene, scene::Scene};
//! use lucerna::settings;
//! use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
//!
//! let file = "fixtures/scenes/cornell_original/cornell_original.gltf";
//! let scene = Scene::load(file.as_ref(), &Default::default())?.scene;
//! let (gpu, _adapter) = blocking::open(&AdapterChoice::Auto)?;
//! let gpu_scene = GpuScene::new(&gpu, &scene, Default::default())?;
//! let size = glam::UVec2::new(32, 32);
//! let settings = settings!(ReferenceSettings { size, n_bounces: 4 });
//! let (sums, _) = blocking::render_reference(
//!     &gpu, &gpu_scene, &scene.cameras[0], &settings, 4, |_progress| true,
//! )?;
//! let picture = resolve(&sums, size, Channel::Beauty);
//! assert_eq!(picture.rgb.len(), 32 * 32);
//! # Ok(())
//! # }
//! # #[cfg(not(all(feature = "gltf", feature = "vulkan")))]
//! # fn main() {}
//! ```
//!
//! `blocking` is for programs: it opens a device and waits for it. A renderer gives its own device
//! to [`gpu::Gpu::new`] and records [`techniques::reference::PathTracer::record`] or
//! [`rays::RayKernel::record`] into its own encoder. Nothing outside `blocking` submits work or waits.
//!
//! # Conventions
//!
//! * Right-handed, +Y up, metres.
//! * Radiometric linear RGB, Rec. 709 primaries: radiance \[W·sr⁻¹·m⁻²\], irradiance \[W·m⁻²\],
//!   intensity \[W·sr⁻¹\]. glTF's candela, lux and nits are read as these.
//! * beauty = emitted + direct + indirect: light reflected never, once, and more than once.
//! * Directions point away from the surface. Matrices are named `dst_from_src`.
//! * Random numbers are hashes of pixel, sample, dimension and seed. The same input on the same
//!   adapter and driver gives the same bytes.
//! * [`picture::Picture`] is linear and unexposed; only PNG output is encoded as sRGB.
//!
//! # Features
//!
//! | feature | what it brings |
//! |---|---|
//! | `gpu` (on by default) | everything on wgpu, which comes without a backend: scenes on the GPU, frames, components, techniques |
//! | `vulkan`, `metal`, `dx12`, `webgpu` | a backend of wgpu; of no use where the program enables wgpu's own |
//! | `compose` | composing at run time: kernels and modules of one's own, hardware ray queries, [`naga`] |
//! | `gltf`, `obj` | scene files, for [`scene::Scene::load`] |
//! | `png`, `jpeg`, `exr` | image files, for [`picture`] and scenes' textures; Radiance HDR is always there |
//! | `compare` | how far two pictures are from each other; its FLIP needs a C++ compiler |
//! | `testing` | WGSL functions by numbers |
//!
//! Without any there are [`modules()`], [`kernels`], [`WGSL_DIR`], [`scene`], [`picture`] and what of [`shader`] describes kernels.
//!
//! # What is promised
//!
//! Everything public, and the modules' import paths, functions and structs; [`bindings`] is not: it is what the build makes of
//! the WGSL. Types of [`glam`], [`wgpu`] and [`naga`] are part of the interface; a new major version of those is one of this
//! crate.

#[cfg(feature = "gpu")]
#[doc(hidden)]
pub mod bindings;
#[cfg(feature = "gpu")]
pub mod blocking;
#[cfg(feature = "compare")]
pub mod compare;
#[cfg(feature = "gpu")]
pub mod components;
#[cfg(feature = "gpu")]
pub mod film;
#[cfg(feature = "gpu")]
pub mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "gpu")]
pub mod gpu_scene;
pub mod picture;
#[cfg(feature = "gpu")]
pub mod rays;
#[cfg(feature = "gpu")]
pub mod report;
pub mod scene;
#[cfg(feature = "gpu")]
pub mod seam;
#[cfg(feature = "gpu")]
pub mod setting;
pub mod shader;
#[cfg(feature = "gpu")]
pub mod techniques;
#[cfg(feature = "testing")]
pub mod testing;

mod modules;
#[cfg(feature = "gpu")]
mod settings_macro;

pub use modules::{Kernel, Module, WGSL_DIR, kernel, kernels, modules};
#[cfg(feature = "compose")]
pub use modules::{library, library_of};

pub use glam;
#[cfg(feature = "compose")]
pub use naga;
#[cfg(feature = "gpu")]
pub use wgpu;
