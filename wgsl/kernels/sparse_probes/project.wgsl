// SPDX-License-Identifier: MIT OR Apache-2.0
//! Coefficients λ of the radiance that arrives at each probe: λ_ij = Σ L(p_i, ω) Y_j(ω) 4π/N over the directions in which it looks.
//!
//! Dispatch: one workgroup for each probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 8192 bytes. No atomics: a workgroup
//! owns its probe.

#import lucerna::components::sparse_probes::directions::look_direction
#import lucerna::components::sparse_probes::seen::{SEEN_SKY, SEEN_UNKNOWN}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::sky::sky_radiance

const WORKGROUP: u32 = 256u;

struct ProjectInfo {
    n_probes: u32,
    n_directions: u32,
    /// At most 64.
    n_coefficients: u32,
    /// 1: the sky is part of what probes see.
    has_sky: u32,
    /// Of this dispatch, only probes `first`, `first + step`, … are updated.
    first: u32,
    step: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ProjectInfo;
/// For each direction of each probe: a receiver, or SEEN_.
@group(1) @binding(1) var<storage, read> seen: array<u32>;
/// `sparse_probes/directions` [sr].
@group(1) @binding(2) var<storage, read> basis: array<f32>;
/// rgb: radiance of each receiver [W·sr⁻¹·m⁻²].
@group(1) @binding(3) var<storage, read> radiance: array<vec4<f32>>;
/// rgb: for each probe, its coefficients [W·sr⁻¹·m⁻²].
@group(1) @binding(4) var<storage, read_write> lambda: array<vec4<f32>>;

var<workgroup> samples: array<vec3<f32>, WORKGROUP>;
var<workgroup> parts: array<vec3<f32>, WORKGROUP>;

/// Radiance that a probe sees in a direction.
fn seen_radiance(what: u32, direction_ix: u32) -> vec3<f32> {
    if what < SEEN_UNKNOWN {
        return radiance[what].rgb;
    }
    if what == SEEN_SKY && info.has_sky != 0u {
        return sky_radiance(look_direction(direction_ix, info.n_directions));
    }
    return vec3<f32>(0.0);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = info.first + group_of_dispatch(group) * info.step;
    // (Uniform over the workgroup.)
    if probe >= info.n_probes {
        return;
    }
    // Of few coefficients, several invocations add up each: every `n_slices`th direction.
    let n = info.n_coefficients;
    let n_slices = WORKGROUP / n;
    let slice = local / n;
    let j = local % n;
    var sum = vec3<f32>(0.0);
    for (var first = 0u; first < info.n_directions; first += WORKGROUP) {
        let n_here = min(WORKGROUP, info.n_directions - first);
        if local < n_here {
            samples[local] = seen_radiance(seen[probe * info.n_directions + first + local], first + local);
        }
        workgroupBarrier();
        if slice < n_slices {
            for (var k = slice; k < n_here; k += n_slices) {
                sum += samples[k] * basis[(first + k) * n + j];
            }
        }
        workgroupBarrier();
    }
    parts[local] = sum;
    workgroupBarrier();
    if slice == 0u {
        for (var k = 1u; k < n_slices; k++) {
            sum += parts[k * n + j];
        }
        lambda[probe * n + j] = vec4<f32>(sum, 0.0);
    }
}
