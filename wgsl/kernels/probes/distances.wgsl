// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far a probe sees in each direction.
//!
//! Each texel of a probe's map is the mean over 4 × 4 rays, spread evenly over the texel. Distances end where a
//! probe is asked about no point that is farther away (`place_reach`).
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::probes::octahedral_map::{MAP_SIDE, direction_of_texel}
#import lucerna::fields::probe_places::{place_position, place_reach, place_unit}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, hit_is_miss}

/// One invocation a texel.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// Rays along each side of a texel.
const RAYS: u32 = 4u;

/// x: probes.
@group(1) @binding(0) var<storage, read> counts: vec4<u32>;
/// See `fields::probe_store`.
@group(1) @binding(1) var<storage, read_write> distances: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    if probe >= counts.x {
        return;
    }
    let position = place_position(probe);
    let most = place_reach(probe);
    let unit = place_unit();
    var moments = vec2<f32>(0.0);
    for (var ix = 0u; ix < RAYS * RAYS; ix++) {
        let inside = (vec2<f32>(vec2<u32>(ix % RAYS, ix / RAYS)) + 0.5) / f32(RAYS);
        let direction = direction_of_texel(local, inside);
        let hit = nearest_hit(Ray(position, 0.0, direction, most * unit));
        let distance = select(min(hit.t / unit, most), most, hit_is_miss(hit));
        moments += vec2<f32>(distance, distance * distance);
    }
    moments /= f32(RAYS * RAYS);
    distances[probe * WORKGROUP + local] = pack2x16float(moments);
}
