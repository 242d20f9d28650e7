// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: where probes are, for kernels that compute what they hold: at corners of a lattice.
//!
//! Interface: `place_position`, `place_is_blocked`, `place_seed`, `place_reach`, `place_unit`, `place_capacity`, `PLACES_BESIDE`,
//! `PLACES_NEAR`, `place_beside`. The layout of `lattice_structure`: `lucerna::components::voxels::bricks`; the second word of a probe is its place
//! (`lucerna::components::probes::place`). The variant `probes=net` has those of nets instead.
#define_import_path lucerna::fields::probe_places

#import lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE, is_air_corner}
#import lucerna::components::probes::place::{place_is_inside, place_moved}
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, is_inside, unpack_cell, world_from_grid}

/// Probes that may be beside one: 27 for each stride of 1, 2 and 4 corners.
const PLACES_BESIDE: u32 = 81u;
/// Those of a stride. Farther ones count only if there are none.
const PLACES_NEAR: u32 = 27u;
/// The longest distance that a map holds [cells]: beyond the diagonal of a cell and what points are moved along their normal.
const REACH: f32 = 2.5;
/// The same for the corners of middle cells, and of wide ones.
const REACH_MIDDLE: f32 = 4.0;
const REACH_WIDE: f32 = 7.5;

/// "Cells" are the corners of the grid's cells, at whole numbers.
@group(3) @binding(36) var<uniform> lattice: VoxelGrid;
@group(3) @binding(37) var<storage, read> lattice_structure: array<vec2<u32>>;

/// The two words of a probe that exists.
fn lattice_record(probe: u32) -> vec2<u32> {
    return lattice_structure[lattice.bricks.x * lattice.bricks.y * lattice.bricks.z + probe];
}

/// Where a probe that exists is [m].
fn place_position(probe: u32) -> vec3<f32> {
    let record = lattice_record(probe);
    return world_from_grid(lattice, vec3<f32>(unpack_cell(record.x)) + place_moved(record.y));
}

/// Whether a probe that exists is inside something, or behind a wall.
fn place_is_blocked(probe: u32) -> bool {
    return place_is_inside(lattice_record(probe).y);
}

/// A number of its own for each probe, which does not depend on the others.
fn place_seed(probe: u32) -> u32 {
    return lattice_record(probe).x;
}

/// The unit of a probe's distances [m].
fn place_unit() -> f32 {
    return lattice.cell;
}

/// How far anybody is from a probe who asks for its light [units].
fn place_reach(probe: u32) -> f32 {
    let corner = unpack_cell(lattice_record(probe).x);
    let is_middle = is_air_corner(corner, lattice.size, MIDDLE_STRIDE);
    let is_wide = is_air_corner(corner, lattice.size, WIDE_STRIDE);
    return select(select(REACH, REACH_MIDDLE, is_middle), REACH_WIDE, is_wide);
}

/// The most probes that there is room for.
fn place_capacity() -> u32 {
    return lattice.capacity;
}

/// A probe beside another, and how much it stands for it; weight 0: there is none.
struct PlaceBeside {
    probe: u32,
    weight: f32,
}

/// The probe `ix` (below PLACES_BESIDE) beside one, if it is not blocked: by the inverse square of its distance.
fn place_beside(probe: u32, ix: u32) -> PlaceBeside {
    let step = vec3<i32>(vec3<u32>(ix % 3u, ix / 3u % 3u, ix / 9u % 3u)) - 1;
    let stride = 1i << (ix / PLACES_NEAR);
    let at = vec3<i32>(unpack_cell(lattice_record(probe).x)) + stride * step;
    if all(step == vec3<i32>(0)) || !is_inside(lattice, at) {
        return PlaceBeside(0u, 0.0);
    }
    let slot = slot_in_brick(lattice_structure[brick_of_cell(lattice, vec3<u32>(at))], vec3<u32>(at));
    if slot == NO_SLOT {
        return PlaceBeside(0u, 0.0);
    }
    return PlaceBeside(slot, select(1.0 / f32(dot(step, step)), 0.0, place_is_blocked(slot)));
}
