// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces by cones: diffuse, specular, and ambient occlusion.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: n_cones cones per pixel, and one more
//! for surfaces that are not Lambertian. Each invocation owns its pixel.

#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::bsdf::directional_albedo::diffuse_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::cone::march::ConeSettings
#import lucerna::fields::cone_gather::gather_cones
#import lucerna::integrators::cone_reflection::cone_reflection
#import lucerna::math::constants::{FLOAT_MAX, INV_PI}
#import lucerna::math::loops::loops_run
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::{pcg, pcg3d}

const WORKGROUP: u32 = 8u;
/// Different from the streams of the diffuse cones.
const SPECULAR_STREAM: u32 = 64u;

struct ShadeInfo {
    cones: ConeSettings,
    n_cones: u32,
    /// 1: surfaces that are not Lambertian have specular light.
    has_specular: u32,
    /// tan of half the aperture of the specular cone; 0: it follows from the roughness.
    specular_spread: f32,
    /// 1: `occlusion` is read: r the open share of the hemisphere close by, g that of the specular cone.
    has_occlusion: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
@group(1) @binding(1) var occlusion: texture_2d<f32>;
/// rgb: radiance [W·sr⁻¹·m⁻²]; a: cosine-weighted share of the hemisphere that is open within
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
                let reflected = cone_reflection(
                    surface.position,
                    surface.geometric_normal,
                    surface.shading_normal,
                    surface.to_viewer,
                    material,
                    info.cones,
                    info.specular_spread,
                    u,
                );
                radiance = open.y * reflected;
            }
        }
        radiance += open.x * diffuse * INV_PI * gathered.irradiance;
        out = vec4<f32>(radiance, open.x * gathered.near_openness);
        // (No picture is 2³¹ pixels wide.) What the driver cut short is not valid light: `frame/composite` leaves it
        // out and counts it.
        if !loops_run(view.size.x >> 31u) {
            out = vec4<f32>(bitcast<f32>(0x7fc00000u | (view.size.x >> 31u)));
        }
    }
    textureStore(indirect, id.xy, out);
}
