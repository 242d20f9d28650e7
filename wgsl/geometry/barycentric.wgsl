// SPDX-License-Identifier: MIT OR Apache-2.0
//! Barycentric coordinates.
#define_import_path lucerna::geometry::barycentric

/// The value between those of three corners; `weights` are those of the second and third.
fn interpolate_vec3(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, weights: vec2<f32>) -> vec3<f32> {
    return a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
}

/// As [`interpolate_vec3`], for pairs.
fn interpolate_vec2(a: vec2<f32>, b: vec2<f32>, c: vec2<f32>, weights: vec2<f32>) -> vec2<f32> {
    return a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
}

/// As [`interpolate_vec3`], for quadruples.
fn interpolate_vec4(a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, weights: vec2<f32>) -> vec4<f32> {
    return a * (1.0 - weights.x - weights.y) + b * weights.x + c * weights.y;
}

/// Weights of the corners `b` and `c` of the orthogonal projection of `point` onto the triangle's
/// plane (outside [0, 1] where it lies outside the triangle).
///
/// The triangle must have an area. C. Ericson, "Real-Time Collision Detection", 2005, §3.4.
fn barycentrics_of(point: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    let normal = cross(b - a, c - a);
    let inverse = 1.0 / dot(normal, normal);
    let second = dot(cross(c - a, a - point), normal) * inverse;
    let third = dot(cross(a - b, a - point), normal) * inverse;
    return vec2<f32>(second, third);
}

/// As [`barycentrics_of`], moved into the triangle by scaling: weights of the second and third corner in [0, 1], with a
/// sum of at most 1, for any point and triangle.
fn barycentrics_within(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    // For a triangle without area in f32 the weights may be NaN, which clamp turns into a number.
    let weights = clamp(barycentrics_of(p, a, b, c), vec2<f32>(0.0), vec2<f32>(1.0));
    return weights / max(weights.x + weights.y, 1.0);
}
