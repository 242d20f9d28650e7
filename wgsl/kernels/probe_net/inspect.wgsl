// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is around each point of a list: whether a probe could be there.
//!
//! Dispatch: one workgroup a point, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 768 bytes.

#import lucerna::components::probes::octahedral_map::MAP_SIDE
#import lucerna::integrators::surroundings::{is_inside_something, surroundings_in_texel}
#import lucerna::math::dispatch::group_of_dispatch

/// One invocation for each texel of an octahedral map.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// Rays along each side of a texel.
const RAYS: u32 = 2u;

struct InspectInfo {
    n_points: u32,
    /// The longest ray [m].
    most: f32,
    reserved_a: u32,
    reserved_b: u32,
}

struct Inspected {
    /// 1: it is inside something, or behind a wall.
    is_inside: u32,
    /// The nearest surface; InspectInfo.most if there is none before [m].
    distance: f32,
}

@group(1) @binding(0) var<uniform> info: InspectInfo;
/// xyz: points [m].
@group(1) @binding(1) var<storage, read> points: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> inspected: array<Inspected>;

var<workgroup> nearest: array<f32, WORKGROUP>;
/// x: rays that end at backs; y: rays that meet anything.
var<workgroup> n_met: array<vec2<u32>, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if ix >= info.n_points {
        return;
    }
    let found = surroundings_in_texel(points[ix].xyz, local, RAYS, info.most);
    nearest[local] = found.distance;
    n_met[local] = vec2<u32>(found.n_backs, found.n_met);
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            n_met[local] += n_met[local + reach];
            nearest[local] = min(nearest[local], nearest[local + reach]);
        }
        workgroupBarrier();
    }
    if local == 0u {
        let is_inside = is_inside_something(n_met[0].x, n_met[0].y, WORKGROUP * RAYS * RAYS);
        inspected[ix] = Inspected(u32(is_inside), nearest[0]);
    }
}
