//! `voxel-rt`: ray-traced voxel global illumination.
//!
//! Irradiance is kept for the faces of the voxels that surfaces stand in. Every frame renews it with a
//! few rays a face, independently of the picture's size; pixels look it up. The method is described
//! in `docs/techniques/voxel-rt.md`.
//!
//! ```text
//! Voxelizer ──structure──▶ CarryPass ──▶ GatherPass (every frame) ──▶ ShadePass
//!  when something moved     keeps what     rays from the faces of       G-buffer → indirect
//!  or the grid scrolled     is known       voxels, n bounces            radiance
//! ```

mod carry;
mod gather;
mod settings;

use crate::bindings::baseline::kernels::voxel_rt::gather as gather_kernel;
use crate::bindings::baseline::lucerna::voxel::grid::VoxelGrid;
use crate::bindings::baseline::lucerna::voxel::levels::{MAX_LEVELS, VoxelLevel, VoxelLevels};
use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::pass::buffer;

pub use crate::bindings::baseline::lucerna::voxel_rt::cache::FaceLight;
pub use carry::{CarryBuffers, CarryInfo, CarryPass};
pub use gather::{GatherBuffers, GatherInfo, GatherPass};
pub use settings::{Bounces, Lookup, VoxelRtSettings};
