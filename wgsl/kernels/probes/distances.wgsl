// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far a probe sees in each direction.
//!
//! Each texel of a probe's map is the mean over 4 × 4 rays, spread evenly over the texel. Distances end where a
//! probe is asked about no point that is farther away: for corners of middle and wide cells later than for others.
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::probes::air::{MIDDLE_STRIDE, WIDE_STRIDE, is_air_corner}
#import lucerna::components::probes::octahedral_map::{MAP_SIDE, direction_of_texel}
#import lucerna::components::voxels::grid::unpack_cell
#import lucerna::fields::probe_lattice::{lattice, lattice_corner, lattice_position}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, hit_is_miss}

/// One invocation a texel.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// Rays along each side of a texel.
const RAYS: u32 = 4u;
/// The longest distance [cells]: beyond the diagonal of a cell and what points are moved along their normal.
const MOST: f32 = 2.5;
/// The same for the corners of middle cells, and of wide ones.
const MOST_MIDDLE: f32 = 4.0;
const MOST_WIDE: f32 = 7.5;

/// x: probes.
@group(1) @binding(0) var<storage, read> counts: vec4<u32>;
/// See `fields::probes`.
@group(1) @binding(1) var<storage, read_write> distances: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    if probe >= counts.x {
        return;
    }
    let position = lattice_position(probe);
    let corner = unpack_cell(lattice_corner(probe));
    let is_middle = is_air_corner(corner, lattice.size, MIDDLE_STRIDE);
    let is_wide = is_air_corner(corner, lattice.size, WIDE_STRIDE);
    let most = select(select(MOST, MOST_MIDDLE, is_middle), MOST_WIDE, is_wide);
    var moments = vec2<f32>(0.0);
    for (var ix = 0u; ix < RAYS * RAYS; ix++) {
        let inside = (vec2<f32>(vec2<u32>(ix % RAYS, ix / RAYS)) + 0.5) / f32(RAYS);
        let direction = direction_of_texel(local, inside);
        let hit = nearest_hit(Ray(position, 0.0, direction, most * lattice.cell));
        let distance = select(min(hit.t / lattice.cell, most), most, hit_is_miss(hit));
        moments += vec2<f32>(distance, distance * distance);
    }
    moments /= f32(RAYS * RAYS);
    distances[probe * WORKGROUP + local] = pack2x16float(moments);
}
