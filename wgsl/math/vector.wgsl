// SPDX-License-Identifier: MIT OR Apache-2.0
//! Small helpers on vectors.
#define_import_path lucerna::math::vector

/// `v / |v|`, or `fallback` where `v` is zero or too small or large for f32 to hold its square
/// (|v|² outside [1e-37, 1e37]).
fn safe_normalize(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let square = dot(v, v);
    // A comparison with NaN is false, so a NaN falls back too.
    if square >= 1e-37 && square <= 1e37 {
        return v * inverseSqrt(square);
    }
    return fallback;
}

/// The largest of the three components.
fn max_component(v: vec3<f32>) -> f32 {
    return max(v.x, max(v.y, v.z));
}

/// The smallest of the three components.
fn min_component(v: vec3<f32>) -> f32 {
    return min(v.x, min(v.y, v.z));
}
