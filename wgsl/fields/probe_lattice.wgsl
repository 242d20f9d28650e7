// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: where probes are, for kernels that compute what they hold.
//!
//! Interface: `lattice`, `lattice_corner`, `lattice_place`, `lattice_position`. The layout of `lattice_structure`:
//! `lucerna::components::voxels::bricks`; the second word of a probe is its place (`lucerna::components::probes::place`).
#define_import_path lucerna::fields::probe_lattice

#import lucerna::components::probes::place::place_moved
#import lucerna::components::voxels::grid::{VoxelGrid, unpack_cell, world_from_grid}

/// "Cells" are the corners of the grid's cells, at whole numbers.
@group(3) @binding(36) var<uniform> lattice: VoxelGrid;
@group(3) @binding(37) var<storage, read> lattice_structure: array<vec2<u32>>;

/// The two words of a probe that exists.
fn lattice_record(probe: u32) -> vec2<u32> {
    return lattice_structure[lattice.bricks.x * lattice.bricks.y * lattice.bricks.z + probe];
}

/// The corner of a probe that exists, packed (`grid::unpack_cell`).
fn lattice_corner(probe: u32) -> u32 {
    return lattice_record(probe).x;
}

/// The place of a probe that exists, packed (`lucerna::components::probes::place`).
fn lattice_place(probe: u32) -> u32 {
    return lattice_record(probe).y;
}

/// Where a probe that exists is [m].
fn lattice_position(probe: u32) -> vec3<f32> {
    let record = lattice_record(probe);
    return world_from_grid(lattice, vec3<f32>(unpack_cell(record.x)) + place_moved(record.y));
}
