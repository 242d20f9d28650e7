// SPDX-License-Identifier: MIT OR Apache-2.0
//! Brings occlusion to the picture: the diffuse one from a quarter of its pixels (joint bilateral upsampling), the specular
//! one through a cross-bilateral Gaussian. Both keep to surfaces alike (`frame::upscale`).
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Each invocation owns a texel of `occlusion`.

#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::frame::upscale::{gaussian_weight, surface_weight}

const WORKGROUP: u32 = 8u;
/// Pixels to either side of the filter, and its standard deviation.
const RADIUS: i32 = 3;
const SIGMA: f32 = 1.5;

struct ResolveInfo {
    has_diffuse: u32,
    has_specular: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ResolveInfo;
/// Of every second pixel of every second row.
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
            open.x = upscaled(id.xy, surface);
        }
        if info.has_specular != 0u {
            open.y = filtered(id.xy, surface);
        }
    }
    textureStore(occlusion, id.xy, vec4<f32>(open, 0.0, 0.0));
}

/// From the four nearest texels of a quarter's pixels.
fn upscaled(pixel: vec2<u32>, surface: GBufferSurface) -> f32 {
    let size = (view.size + 1u) / 2u;
    let base = pixel / 2u;
    let share = 0.5 * vec2<f32>(pixel % 2u);
    var sum = 0.0;
    var total = 0.0;
    for (var ix = 0u; ix < 4u; ix++) {
        let corner = vec2<u32>(ix & 1u, ix >> 1u);
        let texel = min(base + corner, size - 1u);
        let other = pixel_surface(min(2u * texel, view.size - 1u));
        if other.is_surface {
            let bilinear = select(1.0 - share, share, corner != vec2<u32>(0u));
            // (A little of the nearest one, where no surface is alike.)
            let alike = surface_weight(
                other.position - surface.position,
                surface.depth,
                surface.geometric_normal,
                other.geometric_normal,
            );
            let weight = bilinear.x * bilinear.y * (alike + 1e-3);
            sum += weight * textureLoad(diffuse_open, texel, 0).r;
            total += weight;
        }
    }
    return select(1.0, sum / total, total > 0.0);
}

/// The mean over neighbours alike.
fn filtered(pixel: vec2<u32>, surface: GBufferSurface) -> f32 {
    var sum = 0.0;
    var total = 0.0;
    for (var y = -RADIUS; y <= RADIUS; y++) {
        for (var x = -RADIUS; x <= RADIUS; x++) {
            let at = vec2<i32>(pixel) + vec2<i32>(x, y);
            if any(at < vec2<i32>(0)) || any(at >= vec2<i32>(view.size)) {
                continue;
            }
            let other = pixel_surface(vec2<u32>(at));
            if other.is_surface {
                let alike = surface_weight(
                    other.position - surface.position,
                    surface.depth,
                    surface.geometric_normal,
                    other.geometric_normal,
                );
                let weight = gaussian_weight(vec2<f32>(f32(x), f32(y)), SIGMA) * alike;
                sum += weight * textureLoad(specular_open, at, 0).r;
                total += weight;
            }
        }
    }
    return select(1.0, sum / total, total > 0.0);
}
