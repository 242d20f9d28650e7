// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions over the whole sphere.
//!
//! Measure: solid angle [sr]. `u` is uniform in [0, 1)². Archimedes: z is uniform.
#define_import_path lucerna::sampling::sphere

#import lucerna::math::constants::{INV_FOUR_PI, TWO_PI}

/// A uniformly distributed unit vector.
fn sample_uniform_sphere(u: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - 2.0 * u.x;
    // √(1 − z²) without cancellation.
    let radius = 2.0 * sqrt(u.x * (1.0 - u.x));
    let phi = TWO_PI * u.y;
    return vec3<f32>(radius * cos(phi), radius * sin(phi), z);
}

/// Density of [`sample_uniform_sphere`]: 1/(4π) [sr⁻¹].
fn pdf_uniform_sphere() -> f32 {
    return INV_FOUR_PI;
}
