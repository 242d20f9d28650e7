// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds one bake's light to another's, each times a weight: probes are linear in the light.
//!
//! Dispatch: one invocation a coefficient, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct BlendInfo {
    /// Coefficients: COEFFICIENTS times the probes.
    n: u32,
    /// Of what is there before: 0 for the first bake.
    keep: f32,
    reserved_a: u32,
    reserved_b: u32,
    /// Of what is added, for each colour.
    weight: vec3<f32>,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> info: BlendInfo;
/// See `lucerna::components::probes::gathered`; of each, only rgb is blended.
@group(1) @binding(1) var<storage, read> added: array<vec4<f32>>;
@group(1) @binding(2) var<storage, read_write> gathered: array<vec4<f32>>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n {
        return;
    }
    // (What is not kept does not count, whatever it is.)
    let before = select(info.keep * gathered[ix].rgb, vec3<f32>(0.0), info.keep == 0.0);
    gathered[ix] = vec4<f32>(before + info.weight * added[ix].rgb, added[ix].a);
}
