// SPDX-License-Identifier: MIT OR Apache-2.0
//! lucerna: real-time global illumination as WGSL modules with generated host bindings.
//!
//! The algorithms are WGSL files under `wgsl/`. The build script checks them, composes each kernel, and generates the Rust
//! side of their structs and constants. Five techniques use them today: the path tracer
//! ([`techniques::reference`](mod@techniques::reference)), which is the ground truth, and four real-time techniques,
//! [`techniques::voxel_rt`], [`techniques::voxel_cone`], [`techniques::probe_volume`] and `techniques::sparse_probes` (feature `bake`).
//!
//! # Where is what
//!
//! | to … | look at |
//! |---|---|
//! | take WGSL into your own renderer | [`modules()`], [`kernels()`], [`WGSL_DIR`], `library()` and [`shader`] |
//! | open a device, or wrap your own; record passes | [`gpu`] |
//! | load a glTF or OBJ file, or build a scene in code | [`scene`] |
//! | upload a scene to the GPU | [`gpu_scene`] |
//! | use lucerna's kernels on your own scene | [`seam`] |
//! | render frames: G-buffer, direct light, a technique's indirect light | [`frame`] |
//! | choose a technique, or write one | [`techniques`], [`frame::Technique`], [`setting`], [`report`] |
//! | build on what techniques share: voxels, their light, prefiltered voxels, shadow maps | [`components`] |
//! | read a picture back and pick a channel | [`film`] |
//! | trace many rays at once | [`rays`] |
//! | read and write PNG, EXR and HDR | [`picture`] |
//! | wait for the GPU | [`blocking`] |
//! | measure how far apart two pictures are (feature `compare`) | `compare` |
//! | find lights' colours from a picture (feature `fit`) | `fit` |
//! | test your own WGSL by numbers (feature `testing`) | `testing` |
//!
//! # A picture
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use lucerna::film::{Channel, resolve};
//! use lucerna::techniques::reference::ReferenceSettings;
//! use lucerna::{blocking, gpu::AdapterChoice, gpu_scene::GpuScene, scene::Scene, settings};
//!
//! let file = "fixtures/scenes/cornell_original/cornell_original.gltf";
//! let scene = Scene::load(file.as_ref(), &Default::default())?.scene;
//! let (gpu, _adapter) = blocking::open(&AdapterChoice::Auto)?;
//! let gpu_scene = GpuScene::new(&gpu, &scene, Default::default())?;
//! let size = glam::UVec2::new(32, 32);
//! let settings = settings!(ReferenceSettings { n_bounces: 4, ..ReferenceSettings::new(size) });
//! let (sums, _) = blocking::render_reference(
//!     &gpu, &gpu_scene, &scene.cameras[0], &settings, 4, |_progress| true,
//! )?;
//! let picture = resolve(&sums, size, Channel::Beauty);
//! assert_eq!(picture.rgb.len(), 32 * 32);
//! # Ok(())
//! # }
//! ```
//!
//! [`blocking`] is for programs: it opens a device and waits for it. A renderer gives its own device to [`gpu::Gpu::new`] and
//! records into its own command encoder through a [`gpu::Recorder`]. Apart from `blocking`, `testing`, and building an
//! acceleration structure for ray queries, nothing submits work, and nothing waits.
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
//! | feature | what it adds |
//! |---|---|
//! | `gpu` (default) | everything that runs on wgpu, without a backend |
//! | `vulkan`, `metal`, `dx12`, `webgpu` | a backend of wgpu |
//! | `compose` | composing at run time: your own modules and kernels, ray queries |
//! | `gltf`, `obj` | loaders |
//! | `png`, `jpeg`, `exr` | image files |
//! | `bake`, `nets` | light that is computed once and kept in files; Delaunay nets of probes |
//! | `compare` | FLIP, SSIM and other metrics |
//! | `fit` | colours of lights from a picture |
//! | `testing` | tests of WGSL functions by numbers |
//!
//! Without `gpu` the crate holds the modules' texts and what they declare, scenes and pictures.

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
#[cfg(feature = "fit")]
pub mod fit;
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
