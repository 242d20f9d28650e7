// SPDX-License-Identifier: MIT OR Apache-2.0
//! Marks the corners of the wide cells of the air: there will be probes (`lucerna::components::probes::air`).
//!
//! Dispatch: one invocation a corner. Workgroup memory: none. The result does not depend on the order: bits are only set.

#import lucerna::components::probes::air::{WIDE_STRIDE, air_corner, air_size}
#import lucerna::components::voxels::bricks::{bit_of_cell, brick_of_cell}
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> lattice: VoxelGrid;
/// A word for each brick of the lattice.
@group(1) @binding(1) var<storage, read_write> bits: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    let size = air_size(lattice.size, WIDE_STRIDE);
    if ix >= size.x * size.y * size.z {
        return;
    }
    let corner = air_corner(vec3<u32>(ix % size.x, ix / size.x % size.y, ix / (size.x * size.y)), lattice.size, WIDE_STRIDE);
    atomicOr(&bits[brick_of_cell(lattice, corner)], 1u << bit_of_cell(corner));
}
