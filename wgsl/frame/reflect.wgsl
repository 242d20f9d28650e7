// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the surface in a pixel reflects of light whose direction is not known, or only roughly.
#define_import_path lucerna::frame::reflect

#import lucerna::bsdf::directional_albedo::{diffuse_albedo, directional_albedo, specular_albedo}
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::math::constants::INV_PI

/// The radiance that a surface reflects towards the viewer [W·sr⁻¹·m⁻²], of an irradiance [W·m⁻²] that comes about evenly from all
/// directions.
fn reflected_irradiance(surface: GBufferSurface, irradiance: vec3<f32>) -> vec3<f32> {
    var albedo = surface.albedo;
    if !surface.lambert {
        let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
        albedo = directional_albedo(material, dot(surface.to_viewer, surface.shading_normal));
    }
    return albedo * INV_PI * irradiance;
}

/// The radiance that a surface reflects towards the viewer [W·sr⁻¹·m⁻²], of an irradiance [W·m⁻²], and for its specular lobe of the mean radiance there
/// [W·sr⁻¹·m⁻²].
fn reflected_lobes(surface: GBufferSurface, irradiance: vec3<f32>, mirrored: vec3<f32>) -> vec3<f32> {
    if surface.lambert {
        return surface.albedo * INV_PI * irradiance;
    }
    let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
    let cosine = dot(surface.to_viewer, surface.shading_normal);
    return diffuse_albedo(material, cosine) * INV_PI * irradiance + specular_albedo(material, cosine) * mirrored;
}
