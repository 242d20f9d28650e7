// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions over the whole sphere.
#define_import_path lucerna::sampling::sphere

#import lucerna::math::constants::TWO_PI

/// A uniformly distributed unit vector. `u`: uniform in [0, 1)².
fn sample_uniform_sphere(u: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - 2.0 * u.x;
    let radius = sqrt(max(0.0, 1.0 - z * z));
    let phi = TWO_PI * u.y;
    return vec3<f32>(radius * cos(phi), radius * sin(phi), z);
}
