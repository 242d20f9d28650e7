// SPDX-License-Identifier: MIT OR Apache-2.0
//! What receivers reflect of the light of lights: a mean over frames, until something changes. Each frame lights another one of a receiver's points, so that the
//! mean is that of its texel.
//!
//! Dispatch: one invocation for each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::lit_receiver::{LIT_POINTS, LitReceiver}
#import lucerna::integrators::probe_sight::sided_surface
#import lucerna::integrators::receiver_light::light_on_receiver
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::scene::surface::surface_over

const WORKGROUP: u32 = 64u;

struct LightInfo {
    n_receivers: u32,
    /// Frames whose light is part of the mean already; 0: begin anew.
    n_before: u32,
    /// Counts frames, for random numbers.
    frame: u32,
    seed: u32,
    /// Width of a texel [m].
    texel: f32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> info: LightInfo;
@group(1) @binding(1) var<storage, read_write> lit: array<LitReceiver>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_receivers {
        return;
    }
    let point_ix = info.n_before % LIT_POINTS;
    let two = lit[ix].points[point_ix / 2u];
    let point = select(two.xy, two.zw, point_ix % 2u != 0u);
    let weights = unpack2x16unorm(point.y);
    let surface = sided_surface(point.x, weights, lit[ix].side);
    let albedo = surface_over(point.x, weights, info.texel).albedo;
    let reflected = albedo * light_on_receiver(surface, vec3<u32>(ix, info.seed, info.frame));
    // (Light that is not finite never enters what is kept.)
    let share = 1.0 / f32(info.n_before + 1u);
    lit[ix].reflected = mean_with(lit[ix].reflected, select(vec3<f32>(0.0), reflected, all_finite(reflected)), share);
    lit[ix].albedo = mean_with(lit[ix].albedo, albedo, share);
}

/// A mean with another value in it, which is the only one if its share is 1.
fn mean_with(before: vec3<f32>, value: vec3<f32>, share: f32) -> vec3<f32> {
    return select(before + (value - before) * share, value, share == 1.0);
}
