// SPDX-License-Identifier: MIT OR Apache-2.0
//! Marks the corners of the cells that surfaces meet, and those of the middle cells of the air around them: there will be probes.
//!
//! Dispatch: indirect, one invocation a voxel, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none. The result
//! does not depend on the order: bits are only set.

#import lucerna::components::probes::air::{MIDDLE_STRIDE, air_corner, air_size}
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
    // The 64 corners of the middle cell around it and of its 26 neighbours.
    let middle = vec3<i32>(cell / MIDDLE_STRIDE);
    let last = vec3<i32>(air_size(lattice.size, MIDDLE_STRIDE)) - 1;
    for (var ix = 0u; ix < 64u; ix++) {
        let at = middle - 1 + vec3<i32>((vec3<u32>(ix) >> vec3<u32>(0u, 2u, 4u)) & vec3<u32>(3u));
        if all(at >= vec3<i32>(0)) && all(at <= last) {
            let corner = air_corner(vec3<u32>(at), lattice.size, MIDDLE_STRIDE);
            atomicOr(&bits[brick_of_cell(lattice, corner)], 1u << bit_of_cell(corner));
        }
    }
}
