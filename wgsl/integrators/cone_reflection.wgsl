// SPDX-License-Identifier: MIT OR Apache-2.0
//! Specular reflection of a glossy surface, by one cone through prefiltered voxels.
//!
//! Either along a direction sampled from the specular lobe (the samples form the lobe, a narrow cone reduces noise), or
//! along the mirrored direction with a cone of the given width (C. Crassin et al., "Interactive Indirect Illumination
//! Using Voxel Cone Tracing", 2011).
//!
//! Bindings: none of its own; it traces with `fields::cone_trace`.
#define_import_path lucerna::integrators::cone_reflection

#import lucerna::bsdf::bsdf_sample::BsdfSample
#import lucerna::bsdf::directional_albedo::specular_albedo
#import lucerna::bsdf::ggx::spread_of_ggx
#import lucerna::bsdf::metallic_roughness::{MetallicRoughness, sample_specular_lobe}
#import lucerna::cone::march::{Cone, ConeSettings}
#import lucerna::fields::cone_trace::{start_height, trace_cone}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::frame::frame_from_normal

/// Width of the cone along a sampled direction, as a share of the lobe's.
const DRAWN_SHARE: f32 = 0.3;

/// Radiance that the specular lobe reflects to the viewer [W·sr⁻¹·m⁻²].
///
/// `position` [m]; normals and `to_viewer`: unit length. `spread`: tan of half the aperture of the mirrored direction's
/// cone; 0: a direction is sampled, and the cone's width follows from the roughness. `u`: uniform in [0, 1)².
fn cone_reflection(
    position: vec3<f32>,
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    to_viewer: vec3<f32>,
    material: MetallicRoughness,
    settings: ConeSettings,
    spread: f32,
    u: vec2<f32>,
) -> vec3<f32> {
    let basis = frame_from_normal(shading_normal);
    let local = to_viewer * basis;
    var lobe: BsdfSample;
    var width = spread;
    if spread == 0.0 {
        lobe = sample_specular_lobe(material, local, u);
        width = DRAWN_SHARE * spread_of_ggx(material.alpha);
    } else {
        lobe.direction = vec3<f32>(-local.xy, local.z);
        lobe.weight = specular_albedo(material, local.z);
    }
    let direction = basis * lobe.direction;
    if local.z <= 0.0 || lobe.direction.z <= 0.0 || dot(direction, geometric_normal) <= 0.0 {
        return vec3<f32>(0.0);
    }
    let offset = start_height(position, geometric_normal, settings);
    let cone = Cone(position, width, direction, FLOAT_MAX, geometric_normal, offset);
    return lobe.weight * trace_cone(cone, settings, 0.0).radiance;
}
