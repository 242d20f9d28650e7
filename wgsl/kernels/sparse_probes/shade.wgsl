// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, from the lightmap.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: four texels a pixel.

#import lucerna::fields::lightmap::lightmap
#import lucerna::frame::reflect::reflected_irradiance
#import lucerna::integrators::lightmap_pixel::lightmap_place_of_pixel
#import lucerna::scene::pixel::{pixel_surface, view}

const WORKGROUP: u32 = 8u;

/// What is shown: reflected radiance; or irradiance, or the place in the lightmap (red where there is none).
const SHOWN_LIGHT: u32 = 0u;
const SHOWN_IRRADIANCE: u32 = 1u;
const SHOWN_TEXELS: u32 = 2u;

struct ShadeInfo {
    /// A SHOWN_ constant.
    shown: u32,
    /// As in `sparse_probes/receive`.
    scale: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
/// rgb: indirect irradiance · scale; a: 1 where it is known.
@group(1) @binding(1) var lightmap_texels: texture_2d_array<f32>;
/// Linear.
@group(1) @binding(2) var lightmap_sampler: sampler;
/// rgb: radiance [W·sr⁻¹·m⁻²], or what is shown instead.
@group(1) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var shown = vec3<f32>(0.0);
    if surface.is_surface {
        let at = lightmap_place_of_pixel(id.xy, surface.to_viewer);
        let size = vec2<f32>(lightmap.size);
        let texel = textureSampleLevel(lightmap_texels, lightmap_sampler, at.place / size, at.side, 0.0);
        // (Where some of the four texels are unknown, they do not count.)
        let is_known = at.place.x >= 0.0 && texel.a > 0.0;
        let irradiance = select(vec3<f32>(0.0), texel.rgb / (max(texel.a, 1e-6) * info.scale), is_known);
        if info.shown == SHOWN_LIGHT {
            shown = reflected_irradiance(surface, irradiance);
        } else if info.shown == SHOWN_IRRADIANCE {
            shown = irradiance;
        } else {
            let checker = (vec2<u32>(max(at.place, vec2<f32>(0.0))) & vec2<u32>(1u));
            shown = vec3<f32>(at.place / size, f32(checker.x ^ checker.y));
            shown = select(vec3<f32>(1.0, 0.0, 0.0), shown, is_known);
        }
    }
    textureStore(indirect, id.xy, vec4<f32>(shown, 1.0));
}
