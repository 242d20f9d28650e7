// SPDX-License-Identifier: MIT OR Apache-2.0
//! Small helpers on vectors.
#define_import_path lucerna::math::vector

/// `v / |v|`, or `fallback` if `v` is zero, NaN, or too small or large for f32 to hold its square
/// (|v| outside [1e-15, 3e18]). The relative error of each component is at most 4e-7.
fn safe_normalize(v: vec3<f32>, fallback: vec3<f32>) -> vec3<f32> {
    let square = dot(v, v);
    // From 1e-30 on, squares of components that are flushed to zero (below 1.2e-38) do not matter.
    // A comparison with NaN is false, so NaN also gives the fallback.
    if square >= 1e-30 && square <= 1e37 {
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
