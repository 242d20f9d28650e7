// SPDX-License-Identifier: MIT OR Apache-2.0
//! Voxels of a scene: which cells of a grid its surfaces intersect, and the surfaces' attributes
//! there.
//!
//! [`grid_for_bounds`] places a grid, [`Voxelizer`] fills it, [`VoxelAttributes`] computes what the
//! voxels look like. Everything stays on the GPU.

mod attributes;
mod grid;
mod occupancy;
mod raster;
mod scan;
mod voxelize;

/// Advice if a buffer of the voxelizer is too large.
const ADVICE: &str = "use fewer cells, a smaller capacity, or a smaller scene";

pub use attributes::VoxelAttributes;
pub use grid::{
    BRICK, MAX_BINDING, MAX_SIZE, RECORD_BYTES, Resolution, VoxelError, VoxelGrid, capacity_limit,
    grid_for_bounds, n_bricks,
};
pub use occupancy::Occupancy;
pub use raster::{RasterMethod, RasterVoxelizer};
pub use scan::{Scan, ScanPlan};
pub use voxelize::{
    RECORD_GROUPS_OFFSET, TriangleCounter, Triangles, VOXEL_GROUPS_OFFSET, VoxelCounts, Voxelizer,
};
