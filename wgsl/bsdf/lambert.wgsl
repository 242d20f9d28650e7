// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ideal diffuse reflection.
//!
//! Local frame: z is the normal; directions are of unit length, away from the surface. Measure: solid
//! angle.
#define_import_path lucerna::bsdf::lambert

#import lucerna::bsdf::bsdf_sample::BsdfSample
#import lucerna::math::constants::INV_PI
#import lucerna::sampling::hemisphere::{sample_cosine_hemisphere, pdf_cosine_hemisphere}

/// ρ/π [sr⁻¹], without the cosine. `albedo`: ρ in [0, 1].
fn evaluate_lambert(albedo: vec3<f32>) -> vec3<f32> {
    return albedo * INV_PI;
}

/// Density with which [`sample_lambert`] samples a direction of this cosine [sr⁻¹]; 0 below the plane.
fn pdf_lambert(cosine: f32) -> f32 {
    return pdf_cosine_hemisphere(cosine);
}

/// Samples a direction in proportion to its cosine; the weight is the albedo. `u`: uniform in [0, 1)².
fn sample_lambert(albedo: vec3<f32>, u: vec2<f32>) -> BsdfSample {
    let direction = sample_cosine_hemisphere(u);
    return BsdfSample(direction, albedo, pdf_cosine_hemisphere(direction.z));
}
