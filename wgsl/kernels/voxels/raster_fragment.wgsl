// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rasterised voxelization, for comparison: marks the cell of each fragment's centre.
//!
//! Cells that a triangle intersects away from a pixel's centre are missed.
//!
//! Dispatch: none; a draw with `voxels/raster_vertex`.

#import lucerna::components::voxels::bricks::{bit_of_cell, brick_of_cell}
#import lucerna::components::voxels::grid::{VoxelGrid, is_inside}

@group(2) @binding(0) var<uniform> grid: VoxelGrid;
/// One word per brick.
@group(2) @binding(1) var<storage, read_write> bits: array<atomic<u32>>;

@fragment
fn main(@location(0) point: vec3<f32>) {
    let cell = vec3<i32>(floor(point));
    if is_inside(grid, cell) {
        let voxel = vec3<u32>(cell);
        atomicOr(&bits[brick_of_cell(grid, voxel)], 1u << bit_of_cell(voxel));
    }
}
