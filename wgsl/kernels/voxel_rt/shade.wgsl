// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, looked up in the voxels.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: a look-up a pixel,
//! whatever was traced into the voxels.

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::fields::voxel_light::irradiance_at
#import lucerna::frame::gbuffer::{GBufferSurface, GBufferTexels, decode_gbuffer}
#import lucerna::frame::view::FrameView
#import lucerna::math::constants::INV_PI
const WORKGROUP: u32 = 8u;
struct ShadeInfo {
    /// A LOOKUP_ constant of `fields::voxel_light`.
    lookup: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> view: FrameView;
@group(1) @binding(1) var albedo_texture: texture_2d<f32>;
@group(1) @binding(2) var normal_texture: texture_2d<u32>;
@group(1) @binding(3) var emission_texture: texture_2d<f32>;
@group(1) @binding(4) var depth_texture: texture_depth_2d;
@group(1) @binding(5) var<uniform> info: ShadeInfo;
/// rgb: radiance [W·sr⁻¹·m⁻²].
@group(1) @binding(6) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let texels = GBufferTexels(
        textureLoad(albedo_texture, id.xy, 0),
        textureLoad(normal_texture, id.xy, 0).xy,
        textureLoad(emission_texture, id.xy, 0),
        textureLoad(depth_texture, id.xy, 0),
    );
    let surface = decode_gbuffer(view, id.xy, texels);
    var radiance = vec3<f32>(0.0);
    if surface.is_surface {
        var albedo = surface.albedo;
        if !surface.lambert {
            let material = metallic_roughness(surface.albedo, surface.metallic, surface.roughness);
            albedo = directional_albedo(material, dot(surface.to_viewer, surface.shading_normal));
        }
        let irradiance = irradiance_at(surface.position, surface.shading_normal, info.lookup);
        radiance = albedo * INV_PI * irradiance;
    }
    textureStore(indirect, id.xy, vec4<f32>(radiance, 1.0));
}
