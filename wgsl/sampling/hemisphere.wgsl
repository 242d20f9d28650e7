// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions over the hemisphere around +Z.
//!
//! Measure: solid angle [sr]. `u` is uniform in [0, 1)².
#define_import_path lucerna::sampling::hemisphere

#import lucerna::math::constants::{INV_PI, INV_TWO_PI, TWO_PI}

/// A uniformly distributed unit vector with z ≥ 0.
fn sample_uniform_hemisphere(u: vec2<f32>) -> vec3<f32> {
    let radius = sqrt(max(0.0, 1.0 - u.x * u.x));
    let phi = TWO_PI * u.y;
    return vec3<f32>(radius * cos(phi), radius * sin(phi), u.x);
}

/// Density of [`sample_uniform_hemisphere`]: 1/(2π) [sr⁻¹].
fn pdf_uniform_hemisphere() -> f32 {
    return INV_TWO_PI;
}

/// A unit vector with z ≥ 0, distributed as its cosine z/π (Malley's method: uniform on the disc,
/// lifted to the sphere).
fn sample_cosine_hemisphere(u: vec2<f32>) -> vec3<f32> {
    let radius = sqrt(u.x);
    let phi = TWO_PI * u.y;
    return vec3<f32>(radius * cos(phi), radius * sin(phi), sqrt(max(0.0, 1.0 - u.x)));
}

/// Density of [`sample_cosine_hemisphere`] at a direction of that cosine [sr⁻¹]; 0 below the plane.
fn pdf_cosine_hemisphere(cosine: f32) -> f32 {
    return max(cosine, 0.0) * INV_PI;
}
