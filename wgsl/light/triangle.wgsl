// SPDX-License-Identifier: MIT OR Apache-2.0
//! Emissive triangles.
//!
//! Points are sampled uniformly by area; density in solid angle at the receiver: d²/(|cos|·area) with the cosine at the
//! light.
#define_import_path lucerna::light::triangle

#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::sampling::triangle::sample_uniform_triangle

/// A point of a triangle, seen from a receiver.
struct TriangleLightSample {
    /// Unit length, from the receiver towards the point.
    to_light: vec3<f32>,
    /// [m]
    distance: f32,
    /// The point: weights of the second and third corner.
    barycentrics: vec2<f32>,
    /// In solid angle at the receiver [sr⁻¹]; 0: edge-on, without area, or the receiver itself.
    pdf: f32,
    /// At the light, by the triangle's winding: positive where the receiver sees the front face.
    cosine: f32,
}

/// The normal by winding, with the triangle's area as its length [m²].
fn triangle_area_vector(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    return 0.5 * cross(b - a, c - a);
}

/// Area [m²], for any triangle.
fn triangle_area(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> f32 {
    return length(triangle_area_vector(a, b, c));
}

/// Density in solid angle with which [`sample_triangle_light`] samples the point at `distance` [m] in the direction
/// `to_light` (unit length) [sr⁻¹]; 0 for a triangle that is edge-on or has no area.
fn pdf_triangle_light(
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    to_light: vec3<f32>,
    distance: f32,
) -> f32 {
    let projected = abs(dot(triangle_area_vector(a, b, c), to_light));
    return select(0.0, distance * distance / projected, projected > 0.0);
}

/// Samples a point of the triangle for a receiver at `at`. `u`: uniform in [0, 1)².
fn sample_triangle_light(
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    at: vec3<f32>,
    u: vec2<f32>,
) -> TriangleLightSample {
    let barycentrics = sample_uniform_triangle(u);
    let offset = interpolate_vec3(a, b, c, barycentrics) - at;
    let distance = length(offset);
    let area_vector = triangle_area_vector(a, b, c);
    let area = length(area_vector);
    if !(distance > 0.0 && area > 0.0) {
        return TriangleLightSample(vec3<f32>(0.0, 1.0, 0.0), 0.0, barycentrics, 0.0, 0.0);
    }
    let to_light = offset / distance;
    return TriangleLightSample(
        to_light,
        distance,
        barycentrics,
        pdf_triangle_light(a, b, c, to_light, distance),
        -dot(area_vector, to_light) / area,
    );
}
