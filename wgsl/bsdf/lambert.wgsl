// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ideal diffuse reflection.
#define_import_path lucerna::bsdf::lambert

#import lucerna::math::constants::INV_PI

/// ρ/π [sr⁻¹], without the cosine. `albedo`: ρ in [0, 1].
fn evaluate_lambert(albedo: vec3<f32>) -> vec3<f32> {
    return albedo * INV_PI;
}
