// SPDX-License-Identifier: MIT OR Apache-2.0
//! What each probe sees in the directions in which it looks: receivers, the sky, or surfaces that are not in the lightmap.
//!
//! A receiver stands for what a probe sees only if no surface is between that point and the receiver's own: a wall through a texel would else let light
//! through, in as much of the texel as its 4 × 4 places do not tell apart.
//!
//! Dispatch: one invocation for each direction of each probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::directions::look_direction
#import lucerna::components::sparse_probes::seen::{SEEN_SKY, SEEN_UNKNOWN}
#import lucerna::fields::lightmap::{NO_RECEIVER, lightmap, lightmap_place, receiver_at, receiver_in_texel}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::{any_hit, nearest_hit}
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss}

const WORKGROUP: u32 = 64u;

struct LookInfo {
    n_probes: u32,
    /// Directions of each probe.
    n_directions: u32,
    /// How far points are off their surfaces, if nothing is in the way [m].
    lift: f32,
    reserved_a: u32,
}

@group(1) @binding(0) var<uniform> info: LookInfo;
/// xyz: probes [m].
@group(1) @binding(1) var<storage, read> places: array<vec4<f32>>;
/// For each direction of each probe, the receiver, or a SEEN_ constant.
@group(1) @binding(2) var<storage, read_write> seen: array<u32>;
/// xyz: the point that stands for each receiver, off its surface [m].
@group(1) @binding(3) var<storage, read> anchors: array<vec4<f32>>;

/// Whether nothing is between a point and the one that stands for a receiver.
fn is_joined(at: vec3<f32>, receiver: u32) -> bool {
    return !any_hit(Ray(at, 0.0, anchors[receiver].xyz - at, 1.0));
}

/// A point off its surface, above a place on it [m]: below whatever leans over it.
fn lifted(place: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    let lid = nearest_hit(Ray(place, 0.0, normal, info.lift));
    return place + select(0.5 * lid.t, info.lift, hit_is_miss(lid)) * normal;
}

/// The receiver that stands for what is seen: of the nearest of nine texels that is joined to it. If none is, the one that the texels' masks say.
/// `above`: that point, off its surface [m]; `weights`: of the second and third corner; `side`: 0 front, 1 back.
fn receiver_seen(above: vec3<f32>, triangle: u32, weights: vec2<f32>, side: u32) -> u32 {
    let by_mask = receiver_at(triangle, weights, side);
    if by_mask == NO_RECEIVER || is_joined(above, by_mask) {
        return by_mask;
    }
    let place = lightmap_place(triangle, weights);
    let own = min(vec2<u32>(place), lightmap.size - 1u);
    var found = by_mask;
    var nearest = 1e9;
    for (var k = 0u; k < 9u; k++) {
        // (Texels beyond the left and upper border are beyond the right and lower one, too.)
        let at = own + vec2<u32>(k % 3u, k / 3u) - 1u;
        if any(at >= lightmap.size) {
            continue;
        }
        let other = receiver_in_texel(at, side);
        let apart = distance(vec2<f32>(at) + 0.5, place);
        if other != NO_RECEIVER && apart < nearest && is_joined(above, other) {
            nearest = apart;
            found = other;
        }
    }
    return found;
}

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
        let surface = surface_at(hit.triangle, hit.barycentrics);
        let is_back = dot(surface.geometric_normal, direction) > 0.0;
        let normal = select(surface.geometric_normal, -surface.geometric_normal, is_back);
        let above = lifted(offset_ray_origin(surface.position, surface.position_error, normal, normal), normal);
        found = receiver_seen(above, hit.triangle, hit.barycentrics, u32(is_back));
        found = select(found, SEEN_UNKNOWN, found == NO_RECEIVER);
    }
    seen[ix] = found;
}
