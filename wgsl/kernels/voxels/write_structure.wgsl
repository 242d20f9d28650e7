// SPDX-License-Identifier: MIT OR Apache-2.0
//! The grid's structure: for each brick its voxels and first slot, then the cell of each slot.
//!
//! Voxels for which there is no room are left out, the last ones first, and counted.
//!
//! Dispatch: `math/dispatch` of ceil((n_bricks + 1)/64). Workgroup memory: none.

#import lucerna::math::dispatch::{dispatch_of_groups, group_of_dispatch}
#import lucerna::components::voxels::bricks::cell_of_bit
#import lucerna::components::voxels::counts::{COUNTED_WORKGROUP, VoxelCounts}
#import lucerna::components::voxels::grid::{VoxelGrid, pack_cell}

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<storage, read> bits_static: array<u32>;
@group(1) @binding(2) var<storage, read> bits_moving: array<u32>;
/// Number of voxels before each brick, and at the end of all voxels.
@group(1) @binding(3) var<storage, read> n_before: array<u32>;
/// n_bricks × (occupied bits, first slot), then capacity × (packed cell, 0).
@group(1) @binding(4) var<storage, read_write> structure: array<vec2<u32>>;
@group(1) @binding(5) var<storage, read_write> counts: VoxelCounts;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let ix = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    let n_bricks = grid.bricks.x * grid.bricks.y * grid.bricks.z;
    if ix > n_bricks {
        return;
    }
    let first = min(n_before[ix], grid.capacity);
    if ix == n_bricks {
        counts.n_voxels = first;
        counts.n_overflow = n_before[ix] - first;
        counts.n_records = first * grid.n_faces;
        counts.n_undivided = 0u;
        let size = COUNTED_WORKGROUP;
        counts.voxel_groups = dispatch_of_groups((first + size - 1u) / size);
        counts.record_groups = dispatch_of_groups((first * grid.n_faces + size - 1u) / size);
        return;
    }
    var left = bits_static[ix] | bits_moving[ix];
    var kept = 0u;
    var slot = first;
    while left != 0u && slot < grid.capacity {
        let bit = firstTrailingBit(left);
        structure[n_bricks + slot] = vec2<u32>(pack_cell(cell_of_bit(grid, ix, bit)), 0u);
        kept |= 1u << bit;
        left &= left - 1u;
        slot += 1u;
    }
    structure[ix] = vec2<u32>(kept, first);
}
