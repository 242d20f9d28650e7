// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions within a cone around +Z.
//!
//! Measure: solid angle [sr]. `cos_max`: cosine of the half angle, in [−1, 1).
#define_import_path lucerna::sampling::cone

#import lucerna::math::constants::{INV_TWO_PI, TWO_PI}

/// A unit vector, uniformly distributed over the solid angle of the cone. `u` is uniform in [0, 1)².
fn sample_uniform_cone(u: vec2<f32>, cos_max: f32) -> vec3<f32> {
    let below_one = u.x * (1.0 - cos_max);
    // √(1 − z²) without cancellation, so that narrow cones keep their shape.
    let radius = sqrt(below_one * (2.0 - below_one));
    let phi = TWO_PI * u.y;
    return vec3<f32>(radius * cos(phi), radius * sin(phi), 1.0 - below_one);
}

/// Density of [`sample_uniform_cone`] within the cone: 1/(2π(1 − cos_max)) [sr⁻¹].
fn pdf_uniform_cone(cos_max: f32) -> f32 {
    return INV_TWO_PI / (1.0 - cos_max);
}
