// SPDX-License-Identifier: MIT OR Apache-2.0
//! Maps of how far each probe sees: for each texel of an octahedral map, mean distance and mean of its square over the directions in which the probe
//! looks, weighed by the 32nd power of the cosine to the texel's own.
//!
//! Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019.
//!
//! Dispatch: one workgroup for each probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 2048 bytes. No atomics: a workgroup
//! owns its probe.

#import lucerna::components::probes::octahedral_map::{MAP_SIDE, direction_of_texel}
#import lucerna::components::sparse_probes::directions::look_direction
#import lucerna::components::sparse_probes::receiver::Receiver
#import lucerna::components::sparse_probes::seen::{MAP_FAR, SEEN_SKY, SEEN_UNKNOWN}
#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::triangles::triangle_corners

/// An invocation for each texel.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// About the most directions that are used, evenly spread over all.
const MAX_DIRECTIONS: u32 = 4096u;

struct DistancesInfo {
    n_probes: u32,
    n_directions: u32,
    /// The unit of distances [m].
    radius: f32,
    reserved_a: u32,
}

@group(1) @binding(0) var<uniform> info: DistancesInfo;
/// For each direction of each probe: a receiver, or SEEN_.
@group(1) @binding(1) var<storage, read> seen: array<u32>;
@group(1) @binding(2) var<storage, read> receivers: array<Receiver>;
/// As `sparse_places` of `lucerna::fields::sparse_probes`.
@group(1) @binding(3) var<storage, read_write> places: array<vec4<f32>>;

/// xyz: a direction; w: distance [radii], below 0 if it is not known.
var<workgroup> samples: array<vec4<f32>, WORKGROUP>;
var<workgroup> texels: array<vec2<f32>, WORKGROUP>;

/// How far a probe sees in a direction [radii]; below 0 if it is not known.
fn seen_distance(probe: u32, direction_ix: u32) -> f32 {
    let what = seen[probe * info.n_directions + direction_ix];
    if what == SEEN_SKY {
        return MAP_FAR;
    }
    if what == SEEN_UNKNOWN {
        return -1.0;
    }
    let corners = triangle_corners(receivers[what].triangle);
    let at = interpolate_vec3(corners.a, corners.b, corners.c, unpack2x16unorm(receivers[what].weights));
    return min(distance(at, places[probe].xyz) / info.radius, MAP_FAR);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if probe >= info.n_probes {
        return;
    }
    let own = direction_of_texel(local, vec2<f32>(0.5));
    // (An odd step: every second point of Hammersley's set is in one half of the sphere.)
    let step = ((info.n_directions + MAX_DIRECTIONS - 1u) / MAX_DIRECTIONS) | 1u;
    let n = (info.n_directions + step - 1u) / step;
    var sum = vec3<f32>(0.0);
    for (var first = 0u; first < n; first += WORKGROUP) {
        let ix = (first + local) * step;
        if first + local < n {
            samples[local] = vec4<f32>(look_direction(ix, info.n_directions), seen_distance(probe, ix));
        } else {
            samples[local] = vec4<f32>(0.0, 0.0, 0.0, -1.0);
        }
        workgroupBarrier();
        for (var k = 0u; k < WORKGROUP; k++) {
            let found = samples[k];
            if found.w >= 0.0 {
                let weight = pow(max(dot(found.xyz, own), 0.0), 32.0);
                sum += weight * vec3<f32>(1.0, found.w, found.w * found.w);
            }
        }
        workgroupBarrier();
    }
    // (Of directions in which nothing is known, nothing hides the probe.)
    texels[local] = select(vec2<f32>(MAP_FAR, MAP_FAR * MAP_FAR), sum.yz / max(sum.x, 1e-30), sum.x > 1e-20);
    workgroupBarrier();
    if local % 2u == 0u {
        let at = info.n_probes + (probe * WORKGROUP + local) / 2u;
        places[at] = vec4<f32>(texels[local], texels[local + 1u]);
    }
}
