// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces by cones: diffuse, specular, and ambient occlusion.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: n_cones cones a pixel, and one more for
//! what is not Lambert. Each invocation owns its pixel.

#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::bsdf::directional_albedo::{diffuse_albedo, directional_albedo}
#import lucerna::bsdf::fresnel::schlick_fresnel
#import lucerna::bsdf::ggx::{ggx_distribution, ggx_visibility, pdf_ggx_reflection, sample_ggx_visible_normal}
#import lucerna::bsdf::metallic_roughness::{MetallicRoughness, metallic_roughness, normal_reflectance}
#import lucerna::cone::march::{Cone, ConeSettings, cells_across, spread_of_ggx}
#import lucerna::fields::cone_gather::{Gathered, gather_cones}
#import lucerna::fields::cone_trace::{finest_cell, trace_cone}
#import lucerna::math::constants::{FLOAT_MAX, INV_PI}
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::loops::loops_run
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::{pcg, pcg3d}

const WORKGROUP: u32 = 8u;
/// Width of the cone along a drawn direction, in that of the lobe: the draws make the lobe, the cone takes noise away.
const DRAWN_SHARE: f32 = 0.3;
/// Apart from the streams of the diffuse cones.
const SPECULAR_STREAM: u32 = 64u;

struct ShadeInfo {
    cones: ConeSettings,
    n_cones: u32,
    /// 1: surfaces that are not Lambert mirror.
    has_specular: u32,
    /// tan of half the aperture of the mirror's cone; 0: from the roughness.
    specular_spread: f32,
    /// 1: `occlusion` is read: r what is open of the hemisphere close by, g of the mirror's cone.
    has_occlusion: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
@group(1) @binding(1) var occlusion: texture_2d<f32>;
/// rgb: radiance [W·sr⁻¹·m⁻²]; a: cosine-weighted share of the hemisphere that is open as far as
/// `view.occlusion_distance`.
@group(1) @binding(2) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var out = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    if surface.is_surface {
        var open = vec2<f32>(1.0);
        if info.has_occlusion != 0u {
            open = textureLoad(occlusion, id.xy, 0).xy;
        }
        let hash = pcg3d(vec3<u32>(id.xy, view.seed)).x;
        let gathered = gather_cones(
            surface.position,
            surface.geometric_normal,
            surface.shading_normal,
            info.n_cones,
            hash,
            view.frame,
            info.cones,
            FLOAT_MAX,
            view.occlusion_distance,
        );
        var diffuse = surface.albedo;
        var radiance = vec3<f32>(0.0);
        if !surface.lambert {
            let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
            let cosine = dot(surface.to_viewer, surface.shading_normal);
            diffuse = diffuse_albedo(material, cosine);
            if info.has_specular != 0u {
                let u = sobol_owen(view.frame, pcg(hash + SPECULAR_STREAM));
                radiance = open.y * mirrored(surface, material, u);
            }
        }
        radiance += open.x * diffuse * INV_PI * gathered.irradiance;
        out = vec4<f32>(radiance, open.x * gathered.near_openness);
        // (No picture is 2³¹ pixels wide.) What the driver cut short is no light: `frame/composite` leaves it out and counts it.
        if !loops_run(view.size.x >> 31u) {
            out = vec4<f32>(bitcast<f32>(0x7fc00000u | (view.size.x >> 31u)));
        }
    }
    textureStore(indirect, id.xy, out);
}

/// Radiance that the specular lobe reflects: a cone along one drawn direction of it, or along the mirrored one.
fn mirrored(surface: GBufferSurface, material: MetallicRoughness, u: vec2<f32>) -> vec3<f32> {
    let basis = frame_from_normal(surface.shading_normal);
    let out = surface.to_viewer * basis;
    var half_vector = vec3<f32>(0.0, 0.0, 1.0);
    var spread = info.specular_spread;
    let is_drawn = info.specular_spread == 0.0;
    if is_drawn {
        half_vector = sample_ggx_visible_normal(out, material.alpha, u);
        spread = DRAWN_SHARE * spread_of_ggx(material.alpha);
    }
    let local = reflect(-out, half_vector);
    let direction = basis * local;
    if out.z <= 0.0 || local.z <= 0.0 || dot(direction, surface.geometric_normal) <= 0.0 {
        return vec3<f32>(0.0);
    }
    // f·cos/pdf of the drawn direction; of the mirrored one, the whole lobe.
    var weight = max(
        directional_albedo(material, out.z) - diffuse_albedo(material, out.z),
        vec3<f32>(0.0),
    );
    if is_drawn {
        let fresnel = schlick_fresnel(normal_reflectance(material), dot(out, half_vector));
        weight = fresnel * ggx_distribution(half_vector, material.alpha)
            * ggx_visibility(out.z, local.z, material.alpha)
            * local.z / pdf_ggx_reflection(out.z, half_vector, material.alpha);
    }
    let offset =
        info.cones.start_cells * finest_cell(surface.position) * cells_across(surface.geometric_normal);
    let cone = Cone(surface.position, spread, direction, FLOAT_MAX, surface.geometric_normal, offset);
    return weight * trace_cone(cone, info.cones, 0.0).radiance;
}
