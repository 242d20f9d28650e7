//! lucerna: real-time global illumination as WGSL modules with generated host bindings.
//!
//! The algorithms are WGSL files under `wgsl/`. The build script checks them, composes each kernel,
//! and generates the Rust side of their structs, constants and bindings. Today there is one
//! technique, the reference path tracer; the real-time techniques are to come.
//!
//! # Where is what
//!
//! | to … | look at |
//! |---|---|
//! | take WGSL into a renderer of one's own | [`modules()`], [`kernels`], [`library`], [`shader`] |
//! | open a device, or wrap one that is there | [`gpu`] |
//! | load a glTF or OBJ file, or put a scene together | [`scene`] |
//! | bring a scene to the GPU: bind group 0 of every kernel | [`gpu_scene`] |
//! | render frames: G-buffer, direct light, a technique's indirect light | [`frame`] |
//! | trace paths | [`reference`](mod@reference) |
//! | trace many rays at once | [`rays`] |
//! | voxelize a scene | [`voxel`] |
//! | indirect light by ray-traced voxels | [`voxel_rt`] |
//! | read and write PNG, EXR and HDR | [`picture`] |
//! | reach the generated structs and layouts | [`bindings`] |
//! | wait for the GPU (feature `cli`) | `blocking` |
//! | measure how far two pictures differ (feature `cli`) | `compare` |
//!
//! # A picture
//!
//! ```
//! # #[cfg(feature = "cli")]
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use lucerna::{blocking, gpu::AdapterChoice, gpu_scene::GpuScene, scene::Scene};
//! use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
//!
//! let file = "fixtures/scenes/cornell_original/cornell_original.gltf";
//! let scene = Scene::load(file.as_ref(), &Default::default())?.scene;
//! let (gpu, _adapter) = blocking::open(&AdapterChoice::Auto)?;
//! let gpu_scene = GpuScene::new(&gpu, &scene, Default::default())?;
//! let size = glam::UVec2::new(32, 32);
//! let settings =
//!     ReferenceSettings { size, n_bounces: 4, seed: 0, irradiance: false, occlusion_distance: 0.0 };
//! let (sums, _) = blocking::render_reference(
//!     &gpu, &gpu_scene, &scene.cameras[0], &settings, 4, |_progress| true,
//! )?;
//! let picture = resolve(&sums, size, Channel::Beauty);
//! assert_eq!(picture.rgb.len(), 32 * 32);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "cli"))]
//! # fn main() {}
//! ```
//!
//! `blocking` is for programs: it opens a device and waits for it. A renderer gives its own device
//! to [`gpu::Gpu::new`] and records [`reference::PathTracer::record`] or [`rays::RayKernel::record`]
//! into its own encoder. Nothing outside `blocking` submits work or waits.
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
//! `cli`, on by default: the program `lucerna`, and the modules `blocking` and `compare`.

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
pub mod frame;
#[cfg(feature = "gpu")]
pub mod gpu;
#[cfg(feature = "gpu")]
pub mod gpu_scene;
pub mod picture;
#[cfg(feature = "gpu")]
pub mod rays;
pub mod scene;
#[cfg(feature = "gpu")]
pub mod seam;
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
