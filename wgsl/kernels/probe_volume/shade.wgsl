// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, looked up in probes.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: one look-up of eight probes a pixel.

#import lucerna::fields::probes::probe_irradiance
#import lucerna::frame::reflect::reflected_irradiance
#import lucerna::scene::pixel::{pixel_surface, view}

const WORKGROUP: u32 = 8u;

/// What is shown: reflected radiance; or, to inspect the probes, irradiance, or the weight of the probes that were found.
const SHOWN_LIGHT: u32 = 0u;
const SHOWN_IRRADIANCE: u32 = 1u;
const SHOWN_WEIGHT: u32 = 2u;

struct ShadeInfo {
    /// A SHOWN_ constant.
    shown: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
/// rgb: radiance [W·sr⁻¹·m⁻²], or what is shown instead.
@group(1) @binding(1) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var shown = vec3<f32>(0.0);
    if surface.is_surface {
        let found = probe_irradiance(surface.position, surface.shading_normal);
        if info.shown == SHOWN_LIGHT {
            shown = reflected_irradiance(surface, found.rgb);
        } else {
            shown = select(found.rgb, vec3<f32>(found.a), info.shown == SHOWN_WEIGHT);
        }
    }
    textureStore(indirect, id.xy, vec4<f32>(shown, 1.0));
}
