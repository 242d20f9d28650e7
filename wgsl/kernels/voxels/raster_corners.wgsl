// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene's triangles in cells of a grid, for the rasterising voxelizers.
//!
//! Dispatch: `math/dispatch` of ceil(n/64). Workgroup memory: none.

#import lucerna::scene::triangles::{n_triangles, triangle_corners}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{GridTriangle, grid_triangle}

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<storage, read_write> corners: array<GridTriangle>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let ix = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    if ix >= n_triangles() {
        return;
    }
    let t = triangle_corners(ix);
    corners[ix] = grid_triangle(grid, t.a, t.b, t.c);
}
