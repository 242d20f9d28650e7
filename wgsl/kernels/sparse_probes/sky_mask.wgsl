// SPDX-License-Identifier: MIT OR Apache-2.0
//! In which directions each probe sees the sky, as bits.
//!
//! Dispatch: one invocation for each word of each probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::sky_mask::{SKY_MASK_WORDS, sky_mask_direction}
#import lucerna::integrators::probe_sight::probe_sees_sky
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct SkyMaskInfo {
    n_probes: u32,
    /// The first word of the masks.
    first: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: SkyMaskInfo;
/// xyz: probes [m].
@group(1) @binding(1) var<storage, read> places: array<vec4<f32>>;
/// The masks of the probes (`lucerna::components::sparse_probes::sky_mask`), from word `first` on.
@group(1) @binding(2) var<storage, read_write> sight: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_probes * SKY_MASK_WORDS {
        return;
    }
    let place = places[ix / SKY_MASK_WORDS].xyz;
    let first = 32u * (ix % SKY_MASK_WORDS);
    var bits = 0u;
    for (var k = 0u; k < 32u; k++) {
        if probe_sees_sky(place, sky_mask_direction(first + k)) {
            bits |= 1u << k;
        }
    }
    sight[info.first + ix] = bits;
}
