// SPDX-License-Identifier: MIT OR Apache-2.0
//! Filters occlusion for the picture: upsamples the diffuse one from a quarter of its pixels (joint bilateral
//! upsampling), and smooths the specular one with a cross-bilateral Gaussian. Both preserve edges
//! (`integrators::bilateral`).
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Each invocation owns a texel of `occlusion`.

#import lucerna::integrators::bilateral::{cross_bilateral, joint_upsampled}
#import lucerna::scene::pixel::{pixel_surface, view}

const WORKGROUP: u32 = 8u;

struct ResolveInfo {
    has_diffuse: u32,
    has_specular: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ResolveInfo;
/// One texel for every second pixel of every second row.
@group(1) @binding(1) var diffuse_open: texture_2d<f32>;
@group(1) @binding(2) var specular_open: texture_2d<f32>;
/// r: diffuse, g: specular, as openness.
@group(1) @binding(3) var occlusion: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var open = vec2<f32>(1.0);
    if surface.is_surface {
        if info.has_diffuse != 0u {
            open.x = joint_upsampled(diffuse_open, id.xy, surface);
        }
        if info.has_specular != 0u {
            open.y = cross_bilateral(specular_open, id.xy, surface);
        }
    }
    textureStore(occlusion, id.xy, vec4<f32>(open, 0.0, 0.0));
}
