// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prefiltered voxels: the light that leaves the voxels' faces, and their opacity, in ever coarser cells. Widening
//! cones read them (`wgsl/fields/cone_trace.wgsl`).
//!
//! ```text
//! VoxelLight (irradiance of faces) ──▶ PeakPass ──▶ FillPass ──▶ PrefilterPass ──▶ fields::voxel_pyramid
//! VoxelAttributes (albedo, opacity) ───────────────────▲
//! ```

mod fill;
mod peak;
mod pyramid;
mod settings;
mod trace;

pub use fill::{FillInfo, FillPass, PrefilterPass};
pub use peak::PeakPass;
pub use pyramid::{Pyramid, PyramidError, PyramidLayout, PyramidLevel, PyramidMip};
pub use settings::{ConeStepping, FaceWeights, PyramidStorage};
pub use trace::{Cone, ConeResult, TracePass};
