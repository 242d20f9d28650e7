// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds the probes that each point of a list is between, with their weights, and counts the steps.
//!
//! Dispatch: one invocation a point, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::fields::probe_net::net_weights
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct Found {
    probes: vec4<u32>,
    /// Their sum is 1, or 0 if there are no probes.
    weights: vec4<f32>,
}

struct FindCounts {
    /// The most steps of a walk.
    most_steps: atomic<u32>,
    /// Walks that ended before they were there.
    n_lost: atomic<u32>,
}

/// xyz: points [m].
@group(1) @binding(0) var<storage, read> points: array<vec4<f32>>;
/// As many.
@group(1) @binding(1) var<storage, read_write> found: array<Found>;
@group(1) @binding(2) var<storage, read_write> counts: FindCounts;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= arrayLength(&points) {
        return;
    }
    let walk = net_weights(points[ix].xyz);
    found[ix] = Found(walk.probes, walk.weights);
    atomicMax(&counts.most_steps, walk.n_steps);
    if !walk.is_found {
        atomicAdd(&counts.n_lost, 1u);
    }
}
