// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, from the lightmap; of surfaces without a place in it, from the probes themselves.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: four texels a pixel; with radiance, of each coefficient.

#import lucerna::bsdf::ggx::{mean_of_ggx, sharpness_of_ggx}
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::fields::lightmap::{is_within_reach, lightmap, texels_around}
#import lucerna::fields::sparse_probes::sparse_irradiance
#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::frame::reflect::{reflected_irradiance, reflected_lobes}
#import lucerna::integrators::lightmap_pixel::lightmap_place_of_pixel
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::sh::basis::{sh_band, sh_basis_to}
#import lucerna::sh::convolve::sh_cosine_factor
#import lucerna::sh::lobe::{sh_lobe_above, sh_lobe_factors}

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
    /// Greatest band of the radiance that arrives at receivers; 0: irradiance alone is known.
    radiance: u32,
    reserved_a: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
/// rgb: as in `sparse_probes/receive`, times the scale; a: 1 where it is known.
@group(1) @binding(1) var lightmap_texels: texture_2d_array<f32>;
/// rgb: radiance [W·sr⁻¹·m⁻²], or what is shown instead.
@group(1) @binding(2) var indirect: texture_storage_2d<rgba32float, write>;

/// Texels around a place, and their weights.
struct Taps {
    /// The upper left one; may be outside.
    corner: vec2<f32>,
    side: u32,
    /// Of the four, row by row; they add up to 1, or are all 0.
    weights: vec4<f32>,
}

/// A texel of the four, within the lightmap.
fn tap_texel(corner: vec2<f32>, k: u32) -> vec2<f32> {
    return clamp(corner + vec2<f32>(vec2<u32>(k & 1u, k >> 1u)), vec2<f32>(0.0), vec2<f32>(lightmap.size - 1u));
}

/// Bilinear, without the texels that a surface separates from that of the place: light does not cross walls. Nor do texels count that know nothing.
fn taps_around(place: vec2<f32>, side: u32) -> Taps {
    let own = min(vec2<u32>(place), lightmap.size - 1u);
    // (Where something cuts through the texel, and the place is on the other side, those texels count that are there, too.)
    let around = texels_around(own, side);
    let open = select(~around, around, is_within_reach(place, side));
    let corner = floor(place - 0.5);
    let share = place - 0.5 - corner;
    var taps = Taps(corner, side, vec4<f32>(0.0));
    for (var k = 0u; k < 4u; k++) {
        let texel = tap_texel(corner, k);
        let offset = vec2<i32>(texel) - vec2<i32>(own) + 1;
        if (open >> u32(offset.y * 3 + offset.x) & 1u) == 0u {
            continue;
        }
        let weights = mix(1.0 - share, share, vec2<f32>(vec2<u32>(k & 1u, k >> 1u)));
        taps.weights[k] = weights.x * weights.y * textureLoad(lightmap_texels, vec2<u32>(texel), side, 0).a;
    }
    let sum = dot(taps.weights, vec4<f32>(1.0));
    taps.weights = select(vec4<f32>(0.0), taps.weights / max(sum, 1e-6), sum > 0.0);
    return taps;
}

/// What arrives at a place, of an output of `sparse_probes/receive`.
fn lightmap_output(taps: Taps, output: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < 4u; k++) {
        let texel = vec2<u32>(tap_texel(taps.corner, k));
        sum += taps.weights[k] * textureLoad(lightmap_texels, texel, 2u * output + taps.side, 0).rgb;
    }
    return sum / info.scale;
}

/// What arrives at a surface.
struct Arriving {
    /// [W·m⁻²]
    irradiance: vec3<f32>,
    /// Mean radiance in the specular lobe [W·sr⁻¹·m⁻²].
    mirrored: vec3<f32>,
}

/// By the spherical harmonics of the radiance: irradiance on the shading normal is that of the texel on its own, and what the harmonics say of the difference.
fn arriving_radiance(surface: GBufferSurface, taps: Taps) -> Arriving {
    let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
    let lobe = mean_of_ggx(surface.shading_normal, surface.to_viewer, material.alpha);
    let factors = sh_lobe_factors(sharpness_of_ggx(material.alpha));
    var of_normal = sh_basis_to(surface.shading_normal, info.radiance);
    var of_lobe = sh_basis_to(lobe, info.radiance);
    var bands = factors;
    var found = Arriving(lightmap_output(taps, 1u), vec3<f32>(0.0));
    for (var k = 0u; k < (info.radiance + 1u) * (info.radiance + 1u); k++) {
        let coefficient = lightmap_output(taps, 2u + k);
        let band = sh_band(k);
        found.irradiance += sh_cosine_factor(band) * of_normal[k] * coefficient;
        found.mirrored += bands[band] * of_lobe[k] * coefficient;
    }
    // (Light comes from above the surface alone: constant radiance stays what it is.)
    let above = sh_lobe_above(factors, dot(lobe, surface.geometric_normal), info.radiance);
    found.irradiance = max(found.irradiance, vec3<f32>(0.0));
    found.mirrored = max(found.mirrored, vec3<f32>(0.0)) / max(above, 0.25);
    return found;
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
        let taps = taps_around(max(at.place, vec2<f32>(0.0)), at.side);
        let has_place = at.place.x >= 0.0 && any(taps.weights > vec4<f32>(0.0));
        var irradiance: vec3<f32>;
        var is_known = true;
        if has_place && info.radiance > 0u && info.shown == SHOWN_LIGHT {
            let arrives = arriving_radiance(surface, taps);
            irradiance = arrives.irradiance;
            shown = reflected_lobes(surface, irradiance, arrives.mirrored);
        } else {
            if has_place {
                irradiance = lightmap_output(taps, 0u);
            } else {
                let found = sparse_irradiance(surface.position, surface.shading_normal);
                irradiance = found.rgb;
                is_known = found.a > 0.0;
            }
            shown = reflected_irradiance(surface, irradiance);
        }
        if info.shown == SHOWN_IRRADIANCE {
            shown = irradiance;
        } else if info.shown == SHOWN_TEXELS {
            let checker = (vec2<u32>(max(at.place, vec2<f32>(0.0))) & vec2<u32>(1u));
            shown = vec3<f32>(at.place / vec2<f32>(lightmap.size), f32(checker.x ^ checker.y));
            shown = select(select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(1.0), is_known), shown, has_place);
        }
    }
    textureStore(indirect, id.xy, vec4<f32>(shown, 1.0));
}
