// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of lights on receivers: a mean over frames, until something changes.
//!
//! Dispatch: one invocation for each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::lit_receiver::{LitReceiver, triangle_and_side_of}
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
    let at = triangle_and_side_of(lit[ix]);
    let weights = unpack2x16unorm(lit[ix].weights);
    let surface = sided_surface(at.x, weights, at.y);
    var arrives = light_on_receiver(surface, vec3<u32>(ix, info.seed, info.frame));
    // (Light that is not finite never enters what is kept.)
    arrives = select(vec3<f32>(0.0), arrives, all_finite(arrives));
    let share = 1.0 / f32(info.n_before + 1u);
    let before = select(lit[ix].irradiance, vec3<f32>(0.0), info.n_before == 0u);
    lit[ix].irradiance = before + (arrives - before) * share;
    lit[ix].albedo = surface_over(at.x, weights, info.texel).albedo;
}
