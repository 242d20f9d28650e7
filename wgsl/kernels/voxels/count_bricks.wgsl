// SPDX-License-Identifier: MIT OR Apache-2.0
//! Number of voxels of each brick, of static and moving triangles together.
//!
//! One number per brick and a 0 at the end, so that a scan gives each brick's first slot and, at
//! the end, the number of voxels.
//!
//! Dispatch: `math/dispatch` of ceil((n_bricks + 1)/64). Workgroup memory: none.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::grid::VoxelGrid

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<storage, read> bits_static: array<u32>;
@group(1) @binding(2) var<storage, read> bits_moving: array<u32>;
@group(1) @binding(3) var<storage, read_write> n_voxels: array<u32>;

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
    var n = 0u;
    if ix < n_bricks {
        n = countOneBits(bits_static[ix] | bits_moving[ix]);
    }
    n_voxels[ix] = n;
}
