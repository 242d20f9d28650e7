// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light of every pixel, with ray-traced shadows.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Each invocation owns one
//! pixel of `direct`.

#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::integrators::direct_light::{DirectSettings, direct_light}
#import lucerna::math::float::all_finite
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 8u;

/// Numbers of pixels, over all frames.
struct DirectFaults {
    /// Pixels whose light was not finite and was replaced by 0.
    n_rejected: atomic<u32>,
    /// Pixels whose light is wrong because the driver ended loops early (`math::loops`).
    n_cut: atomic<u32>,
}

@group(1) @binding(0) var<uniform> settings: DirectSettings;
/// rgb: radiance [W·sr⁻¹·m⁻²]; 0 where there is no surface. a: 1 on surfaces.
@group(1) @binding(1) var direct: texture_storage_2d<rgba32float, write>;
@group(1) @binding(2) var<storage, read_write> faults: DirectFaults;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if any(pixel >= view.size) {
        return;
    }
    let surface = pixel_surface(pixel);
    var light = vec3<f32>(0.0);
    if surface.is_surface {
        light = direct_light(surface, settings, vec3<u32>(pixel, view.seed), view.frame);
        if !all_finite(light) {
            light = vec3<f32>(0.0);
            atomicAdd(&faults.n_rejected, 1u);
        }
        // (No picture is 2³¹ pixels wide.)
        if !loops_run(view.size.x >> 31u) {
            atomicAdd(&faults.n_cut, 1u);
        }
    }
    textureStore(direct, pixel, vec4<f32>(light, select(0.0, 1.0, surface.is_surface)));
}
