// SPDX-License-Identifier: MIT OR Apache-2.0
//! Number of pieces of work into which the voxelizer cuts each triangle.
//!
//! One number per triangle and a 0 at the end, so that a scan gives each triangle's first piece and, at the end, the
//! number of pieces.
//!
//! Dispatch: `math/dispatch` of ceil((n + 1)/64). Workgroup memory: none.

#import lucerna::scene::triangles::{n_triangles, triangle_corners, triangle_moves}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{columns_of_triangle, grid_triangle, n_work_of_columns}

const WORKGROUP: u32 = 64u;

const SET_ALL: u32 = 0u;
const SET_STATIC: u32 = 1u;
const SET_MOVING: u32 = 2u;

struct TriangleSet {
    /// SET_ constant.
    which: u32,
}

/// Whether a triangle that moves, or does not, is in the set.
fn is_in_set(which: u32, moves: bool) -> bool {
    return which == SET_ALL
        || (which == SET_MOVING && moves)
        || (which == SET_STATIC && !moves);
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> part: TriangleSet;
@group(1) @binding(2) var<storage, read_write> work: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let ix = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    if ix > n_triangles() {
        return;
    }
    var n = 0u;
    if ix < n_triangles() && is_in_set(part.which, triangle_moves(ix)) {
        let corners = triangle_corners(ix);
        n = n_work_of_columns(
            columns_of_triangle(grid, grid_triangle(grid, corners.a, corners.b, corners.c)),
        );
    }
    work[ix] = n;
}
