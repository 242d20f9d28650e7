// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces a list of cones through the voxels, for tests, measurements, and anything that needs a few cones of its own.
//!
//! Dispatch: one invocation a cone, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::cone::march::{Cone, ConeSettings}
#import lucerna::fields::cone_trace::{ConeResult, trace_cone}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct TraceInfo {
    cones: ConeSettings,
    /// See `fields::cone_trace` [m].
    near: f32,
    n_cones: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: TraceInfo;
@group(1) @binding(1) var<storage, read> cones: array<Cone>;
@group(1) @binding(2) var<storage, read_write> results: array<ConeResult>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix < info.n_cones {
        results[ix] = trace_cone(cones[ix], info.cones, info.near);
    }
}
