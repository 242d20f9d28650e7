// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the surface in a pixel reflects of light whose direction is not known.
#define_import_path lucerna::frame::reflect

#import lucerna::bsdf::directional_albedo::directional_albedo
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
