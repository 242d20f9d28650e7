// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reflection at a surface that is either Lambertian or glTF's metallic-roughness.
//!
//! Local frame: z is the shading normal on the viewer's side; directions are of unit length, away
//! from the surface. Measure: solid angle.
#define_import_path lucerna::bsdf::scattering

#import lucerna::bsdf::bsdf_sample::BsdfSample
#import lucerna::bsdf::lambert::{evaluate_lambert, pdf_lambert, sample_lambert}
#import lucerna::bsdf::metallic_roughness::MetallicRoughness
#import lucerna::bsdf::metallic_roughness::{evaluate_metallic_roughness, pdf_metallic_roughness, sample_metallic_roughness}

/// Reflection at a surface, seen from one direction.
struct Scattering {
    material: MetallicRoughness,
    /// Lambertian with `material.base_color` for albedo.
    lambert: bool,
    to_viewer: vec3<f32>,
}

/// f [sr⁻¹], without the cosine. `to_light`: above the surface if it is Lambertian, otherwise any direction.
fn evaluate_scattering(scattering: Scattering, to_light: vec3<f32>) -> vec3<f32> {
    if scattering.lambert {
        return evaluate_lambert(scattering.material.base_color);
    }
    return evaluate_metallic_roughness(scattering.material, scattering.to_viewer, to_light);
}

/// Density with which [`scatter`] samples a direction [sr⁻¹].
fn scattering_pdf(scattering: Scattering, to_light: vec3<f32>) -> f32 {
    if scattering.lambert {
        return pdf_lambert(to_light.z);
    }
    return pdf_metallic_roughness(scattering.material, scattering.to_viewer, to_light);
}

/// Samples a direction in the local frame. `u`: uniform in [0, 1)³.
fn scatter(scattering: Scattering, u: vec3<f32>) -> BsdfSample {
    if scattering.lambert {
        return sample_lambert(scattering.material.base_color, u.xy);
    }
    return sample_metallic_roughness(scattering.material, scattering.to_viewer, u);
}
