// SPDX-License-Identifier: MIT OR Apache-2.0
//! What each probe sees in the directions in which it looks: receivers, the sky, or surfaces that are not in the lightmap.
//!
//! Dispatch: one invocation for each direction of each probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::directions::look_direction
#import lucerna::fields::lightmap::{NO_RECEIVER, receiver_at}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss}

const WORKGROUP: u32 = 64u;
/// What a probe sees that is no receiver: the sky, and a surface without texels.
const SEEN_SKY: u32 = 0xffffffffu;
const SEEN_UNKNOWN: u32 = 0xfffffffeu;

struct LookInfo {
    n_probes: u32,
    /// Directions of each probe.
    n_directions: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: LookInfo;
/// xyz: probes [m].
@group(1) @binding(1) var<storage, read> places: array<vec4<f32>>;
/// For each direction of each probe, the receiver, or a SEEN_ constant.
@group(1) @binding(2) var<storage, read_write> seen: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_probes * info.n_directions {
        return;
    }
    let direction = look_direction(ix % info.n_directions, info.n_directions);
    let hit = nearest_hit(Ray(places[ix / info.n_directions].xyz, 0.0, direction, FLOAT_MAX));
    var found = SEEN_SKY;
    if !hit_is_miss(hit) {
        let is_back = dot(surface_at(hit.triangle, hit.barycentrics).geometric_normal, direction) > 0.0;
        found = receiver_at(hit.triangle, hit.barycentrics, u32(is_back));
        found = select(found, SEEN_UNKNOWN, found == NO_RECEIVER);
    }
    seen[ix] = found;
}
