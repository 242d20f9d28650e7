// SPDX-License-Identifier: MIT OR Apache-2.0
//! The radiance that receivers reflect, of the light of lights and of the indirect light of the frame before. Light that surfaces emit themselves is
//! not part of it: pixels find it themselves.
//!
//! Dispatch: one invocation for each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::lit_receiver::LitReceiver
#import lucerna::math::constants::INV_PI
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct ReflectInfo {
    n_receivers: u32,
    /// 1: the indirect light of the frame before is reflected as well.
    bounces: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ReflectInfo;
@group(1) @binding(1) var<storage, read> lit: array<LitReceiver>;
/// rgb: indirect irradiance of the frame before [W·m⁻²].
@group(1) @binding(2) var<storage, read> irradiance: array<vec4<f32>>;
/// rgb: radiance that each receiver reflects [W·sr⁻¹·m⁻²].
@group(1) @binding(3) var<storage, read_write> radiance: array<vec4<f32>>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_receivers {
        return;
    }
    let indirect = select(vec3<f32>(0.0), irradiance[ix].rgb, info.bounces != 0u);
    radiance[ix] = vec4<f32>(INV_PI * (lit[ix].reflected + lit[ix].albedo * indirect), 0.0);
}
