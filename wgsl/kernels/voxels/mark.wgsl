// SPDX-License-Identifier: MIT OR Apache-2.0
//! Marks every cell that a triangle meets: one bit a cell.
//!
//! An invocation does one piece of work (see `voxel/work`) and finds its triangle by bisection.
//!
//! Dispatch: indirect, from `voxels/work_groups`. Workgroup memory: none. Bits are only set, so the
//! result does not depend on the order.

#import lucerna::scene::triangles::{n_triangles, triangle_corners}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::bricks::{bit_of_cell, brick_of_cell}
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{COLUMNS, cells_of_column, columns_of_triangle, grid_triangle, triangle_meets_cell}

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
/// The first piece of each triangle, and at the end how many pieces there are.
@group(1) @binding(1) var<storage, read> work: array<u32>;
/// One word a brick.
@group(1) @binding(2) var<storage, read_write> bits: array<atomic<u32>>;

/// The triangle that a piece belongs to: the last one whose first piece is not above it.
fn triangle_of_piece(piece: u32) -> u32 {
    var low = 0u;
    var high = n_triangles();
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if work[middle] <= piece {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let piece = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    if piece >= work[n_triangles()] {
        return;
    }
    let ix = triangle_of_piece(piece);
    let corners = triangle_corners(ix);
    let t = grid_triangle(grid, corners.a, corners.b, corners.c);
    let columns = columns_of_triangle(grid, t);
    let first = (piece - work[ix]) * COLUMNS;
    for (var k = first; k < min(first + COLUMNS, columns.n); k++) {
        let run = cells_of_column(t, columns, k);
        var cell = run.xyz;
        while cell[columns.axis] < run.w {
            if triangle_meets_cell(t, cell) {
                let brick = brick_of_cell(grid, cell);
                let bit = 1u << bit_of_cell(cell);
                // Most cells of a fine mesh are marked already, and a load costs less.
                if (atomicLoad(&bits[brick]) & bit) == 0u {
                    atomicOr(&bits[brick], bit);
                }
            }
            cell[columns.axis] += 1u;
        }
    }
}
