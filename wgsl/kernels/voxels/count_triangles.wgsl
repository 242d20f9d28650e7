// SPDX-License-Identifier: MIT OR Apache-2.0
//! Number of triangles that intersect each cell: counts what `voxels/mark` marks.
//!
//! For tests and for choosing a grid; voxelization does not need it. An invocation does one piece of work (see
//! `components::voxels::work`) and finds its triangle by bisection.
//!
//! Dispatch: indirect, from `voxels/work_groups`. Workgroup memory: none. Sums of integers do not
//! depend on the order.

#import lucerna::integrators::triangle_pieces::{next_cell, walk_piece}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::grid::VoxelGrid

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
/// One number per cell, x fastest.
@group(1) @binding(1) var<storage, read_write> counts: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    var walk = walk_piece(grid, group_of_dispatch(workgroup_id) * WORKGROUP + local);
    while next_cell(&walk) {
        let cell = walk.cell;
        atomicAdd(&counts[(cell.z * grid.size.y + cell.y) * grid.size.x + cell.x], 1u);
    }
}
