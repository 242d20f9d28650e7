// SPDX-License-Identifier: MIT OR Apache-2.0
//! The placement of a grid's cells.

use crate::bindings::lucerna::components::voxels::grid as wgsl;
use crate::gpu::GpuError;
use glam::{UVec3, Vec3};

pub use wgsl::VoxelGrid;

/// Cells of a brick along each axis: `BRICK` in `wgsl/components/voxels/bricks.wgsl` (a vector, which the
/// generated bindings leave out; `voxelize::bricks_are_the_shaders` compares them).
pub const BRICK: UVec3 = UVec3::new(4, 4, 2);

/// The most cells along an axis.
pub const MAX_SIZE: u32 = 256;

/// Cells between the scene's box and the grid's border.
const MARGIN: f32 = 1.5;

/// Distance of the scene's middle from the grid's [cells], so that walls at even distances do not fall on borders of
/// cells. The components are not small multiples of each other.
const OFFSET: Vec3 = Vec3::new(0.1370, 0.2113, 0.1771);

/// The size that every binding of baseline WebGPU can have \[bytes\].
pub const MAX_BINDING: u64 = 128 << 20;

/// How fine a grid is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resolution {
    /// Cells along the longest axis, including the margin; the other axes get what they need.
    Longest(u32),
    /// Cells along each axis.
    Size(UVec3),
}

/// A grid is not possible, or voxels could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VoxelError {
    /// A size is 0 or too large.
    #[error("a grid of {} x {} x {} cells is not possible: each axis takes 1 to 256", .0.x, .0.y, .0.z)]
    Size(UVec3),
    /// The number of faces is neither 1 nor 6.
    #[error("{0} faces per voxel are not possible: use 1 (isotropic) or 6 (anisotropic)")]
    Faces(u32),
    /// The bounds are not finite, or minimum and maximum are swapped.
    #[error("bounds {min} to {max} are not a box")]
    Bounds {
        /// Minimum corner \[m\].
        min: Vec3,
        /// Maximum corner \[m\].
        max: Vec3,
    },
    /// f32 cannot tell the cells apart.
    #[error(
        "cells of {cell} m at {far} m from the origin are finer than 32-bit floats; use fewer cells or move the scene to the origin"
    )]
    TooFine {
        /// Edge of a cell \[m\].
        cell: f32,
        /// The largest coordinate \[m\].
        far: f32,
    },
    /// The capacity is 0, or needs a binding above 128 MiB.
    #[error(
        "a capacity of {capacity} voxels is not possible: 1 to {limit} are, with {n_faces} faces per voxel, so that no binding is above 128 MiB (134217728 bytes)"
    )]
    Capacity {
        /// The requested capacity.
        capacity: u32,
        /// The largest possible capacity.
        limit: u32,
        /// Faces per voxel.
        n_faces: u32,
    },
    /// Bakes whose probes are at other places cannot be blended.
    #[error(
        "the bakes have their probes at other places, so that they cannot be blended: bake them with the same cells (and without --refine, which divides cells by light)"
    )]
    OtherProbes,
    /// A bake's points make no net, or (without the feature `nets`) none is possible.
    #[error("the points of the bake make no net: bake again (with lucerna's feature `nets`)")]
    NoNet,
    /// Too little memory for a part of a file of probes.
    #[error("{bytes} bytes have no room for probes: at least {least} are needed")]
    NoRoom {
        /// What was allowed.
        bytes: u64,
        /// What a brick of probes needs, and the lattice.
        least: u64,
    },
    /// Bakes have no band 4.
    #[error(
        "bakes keep spherical harmonics of order 2: the basis sh4 is only for probes that gather their light"
    )]
    NoBand,
    /// Neither bakes nor nets have masks.
    #[error("neither bakes nor nets have masks of what probes see: use distances")]
    NoMasks,
    /// The scene differs from the one that the voxelizer was made for.
    #[error(transparent)]
    Mismatch(#[from] crate::seam::Mismatch),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// Bytes of the attributes of one face of a voxel.
pub const RECORD_BYTES: u64 = 16;

/// The largest number of voxels whose structure and attributes fit bindings of 128 MiB.
pub fn capacity_limit(bricks: UVec3, n_faces: u32) -> u32 {
    let records = MAX_BINDING / (RECORD_BYTES * u64::from(n_faces.max(1)));
    let entries = MAX_BINDING / 8;
    let n_bricks = u64::from(bricks.x) * u64::from(bricks.y) * u64::from(bricks.z);
    records.min(entries.saturating_sub(n_bricks)) as u32
}

/// A grid around a box, with a margin of 1.5 cells (a quarter of the axis if it has fewer than 6 cells), so that no
/// surface of the box lies on the grid's border.
///
/// `min`, `max` \[m\]: the scene's box, as from [`GpuScene::bounds`](crate::gpu_scene::GpuScene::bounds); it may be
/// flat or a point. `n_faces`: 1 or 6. `capacity`: how many voxels there is room for; None: all cells, but at most 16
/// times the cells of the grid's largest side, and no more than fit into a binding of 128 MiB.
///
/// # Errors
/// [`VoxelError`] other than `Mismatch` and `Gpu`.
pub fn grid_for_bounds(
    min: Vec3,
    max: Vec3,
    resolution: Resolution,
    n_faces: u32,
    capacity: Option<u32>,
) -> Result<VoxelGrid, VoxelError> {
    // Not `min > max`, because NaN must fail as well.
    if !(min.is_finite() && max.is_finite() && min.cmple(max).all() && (max - min).is_finite()) {
        return Err(VoxelError::Bounds { min, max });
    }
    if n_faces != 1 && n_faces != 6 {
        return Err(VoxelError::Faces(n_faces));
    }
    let valid = |size: UVec3| size.min_element() >= 1 && size.max_element() <= MAX_SIZE;
    let extent = max - min;
    let inner = |n: u32| n as f32 - 2.0 * MARGIN.min(n as f32 / 4.0);
    let (size, cell) = match resolution {
        Resolution::Longest(n) => {
            if !valid(UVec3::splat(n)) {
                return Err(VoxelError::Size(UVec3::splat(n)));
            }
            let longest = extent.max_element();
            let cell = if longest > 0.0 { longest / inner(n) } else { 1.0 };
            let margin = n as f32 - inner(n);
            let cells = (extent / cell + margin).ceil().as_uvec3();
            (cells.clamp(UVec3::ONE, UVec3::splat(n)), cell)
        }
        Resolution::Size(size) => {
            if !valid(size) {
                return Err(VoxelError::Size(size));
            }
            let room = Vec3::from_array(size.to_array().map(inner));
            let cell = (extent / room).max_element();
            (size, if cell > 0.0 { cell } else { 1.0 })
        }
    };
    // With smaller cells, neighbouring cells and points within them would be the same number.
    let far = min.abs().max(max.abs()).max_element();
    if !(cell >= 64.0 * f32::EPSILON * far && (1e-18..=1e15).contains(&cell)) {
        return Err(VoxelError::TooFine { cell, far });
    }
    let bricks = (size + BRICK - 1) / BRICK;
    let limit = capacity_limit(bricks, n_faces);
    let n_cells = size.element_product();
    let largest_side = (size.x * size.y).max(size.y * size.z).max(size.z * size.x);
    let capacity = capacity.unwrap_or(n_cells.min(16 * largest_side).min(limit));
    if capacity == 0 || capacity > limit {
        return Err(VoxelError::Capacity { capacity, limit, n_faces });
    }
    let center = min + 0.5 * extent;
    let origin = center - (0.5 * size.as_vec3() - OFFSET) * cell;
    Ok(VoxelGrid { origin, cell, size, n_faces, bricks, capacity })
}

/// Bricks of a grid.
pub fn n_bricks(grid: &VoxelGrid) -> u32 {
    grid.bricks.element_product()
}
