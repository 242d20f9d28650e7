// SPDX-License-Identifier: MIT OR Apache-2.0
//! Packs the gathered light of each probe into its basis (`lucerna::components::probes::basis`).
//!
//! Bands are multiplied by a window against ringing. A probe that is inside something gets the mean light of those around it that are not,
//! by the inverse square of their distance, so that a surface that finds no other probe is not dark.
//!
//! Dispatch: indirect, one invocation a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::probes::bands::{KEPT_COEFFICIENTS, band_factor, place_of_coefficient}
#import lucerna::components::probes::basis::{WORDS, pack_light}
#import lucerna::fields::probe_places::{PLACES_BESIDE, PLACES_NEAR, place_beside, place_capacity, place_is_blocked}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct PackInfo {
    /// Factors of the bands 0, 1, 2 and 4 (`lucerna::sh::window`).
    window: vec4<f32>,
}

@group(1) @binding(0) var<uniform> info: PackInfo;
/// x: probes.
@group(1) @binding(1) var<storage, read> counts: vec4<u32>;
/// See `lucerna::components::probes::gathered`.
@group(1) @binding(2) var<storage, read> gathered: array<vec4<f32>>;
/// WORDS for each probe.
@group(1) @binding(3) var<storage, read_write> light: array<u32>;

/// Adds `weight` times what was gathered for a probe.
fn add(sum: ptr<function, array<vec3<f32>, KEPT_COEFFICIENTS>>, probe: u32, weight: f32) {
    for (var k = 0u; k < KEPT_COEFFICIENTS; k++) {
        (*sum)[k] += weight * gathered[place_of_coefficient(probe, k, place_capacity())].rgb;
    }
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group) * WORKGROUP + local;
    if probe >= counts.x {
        return;
    }
    var sum: array<vec3<f32>, KEPT_COEFFICIENTS>;
    var total = 0.0;
    if place_is_blocked(probe) {
        for (var ix = 0u; ix < PLACES_BESIDE; ix++) {
            if ix % PLACES_NEAR == 0u && total > 0.0 {
                break;
            }
            let beside = place_beside(probe, ix);
            if beside.weight > 0.0 {
                add(&sum, beside.probe, beside.weight);
                total += beside.weight;
            }
        }
    }
    if total == 0.0 {
        add(&sum, probe, 1.0);
        total = 1.0;
    }
    for (var k = 0u; k < KEPT_COEFFICIENTS; k++) {
        sum[k] *= band_factor(k, info.window) / total;
    }
    var words = pack_light(sum);
    for (var k = 0u; k < WORDS; k++) {
        light[probe * WORDS + k] = words[k];
    }
}
