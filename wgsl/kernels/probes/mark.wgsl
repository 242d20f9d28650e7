// SPDX-License-Identifier: MIT OR Apache-2.0
//! Marks the corners of the cells that surfaces meet: there will be probes.
//!
//! Dispatch: indirect, one invocation a voxel, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none. The result
//! does not depend on the order: bits are only set.

#import lucerna::components::voxels::bricks::{bit_of_cell, brick_of_cell}
#import lucerna::components::voxels::grid::{VoxelGrid, unpack_cell}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

/// Of the cells.
@group(1) @binding(0) var<uniform> grid: VoxelGrid;
/// Of their corners: one more along each axis.
@group(1) @binding(1) var<uniform> lattice: VoxelGrid;
/// x: occupied voxels.
@group(1) @binding(2) var<storage, read> counts: vec4<u32>;
/// Of the cells (`lucerna::components::voxels::bricks`).
@group(1) @binding(3) var<storage, read> structure: array<vec2<u32>>;
/// A word for each brick of the lattice.
@group(1) @binding(4) var<storage, read_write> bits: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = group_of_dispatch(group) * WORKGROUP + local;
    if slot >= counts.x {
        return;
    }
    let cell = unpack_cell(structure[grid.bricks.x * grid.bricks.y * grid.bricks.z + slot].x);
    for (var ix = 0u; ix < 8u; ix++) {
        let corner = cell + ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u));
        atomicOr(&bits[brick_of_cell(lattice, corner)], 1u << bit_of_cell(corner));
    }
}
