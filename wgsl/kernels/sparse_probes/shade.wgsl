// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, from the lightmap.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: four texels a pixel.

#import lucerna::fields::lightmap::{is_within_reach, lightmap, texels_around}
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
/// rgb: radiance [W·sr⁻¹·m⁻²], or what is shown instead.
@group(1) @binding(2) var indirect: texture_storage_2d<rgba32float, write>;

/// Indirect irradiance at a place of the lightmap, times the scale; a: the sum of the weights of texels that are known. Bilinear, without the texels that a
/// surface separates from that of the place: light does not cross walls.
fn lightmap_light(place: vec2<f32>, side: u32) -> vec4<f32> {
    let own = min(vec2<u32>(place), lightmap.size - 1u);
    // (Where something cuts through the texel, and the place is on the other side, those texels count that are there, too.)
    let around = texels_around(own, side);
    let open = select(~around, around, is_within_reach(place, side));
    let corner = floor(place - 0.5);
    let share = place - 0.5 - corner;
    var sum = vec4<f32>(0.0);
    for (var k = 0u; k < 4u; k++) {
        let step = vec2<f32>(vec2<u32>(k & 1u, k >> 1u));
        let texel = clamp(corner + step, vec2<f32>(0.0), vec2<f32>(lightmap.size - 1u));
        let offset = vec2<i32>(texel) - vec2<i32>(own) + 1;
        if (open >> u32(offset.y * 3 + offset.x) & 1u) == 0u {
            continue;
        }
        let weights = mix(1.0 - share, share, step);
        sum += weights.x * weights.y * textureLoad(lightmap_texels, vec2<u32>(texel), side, 0);
    }
    return sum;
}

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
        let texel = lightmap_light(max(at.place, vec2<f32>(0.0)), at.side);
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
