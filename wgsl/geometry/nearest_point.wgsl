// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a point is in a tetrahedron, and the point of a triangle or a segment that is nearest to it.
#define_import_path lucerna::geometry::nearest_point

/// Where a point is in a tetrahedron.
struct InTetrahedron {
    /// How far it is in front of the faces opposite to a, b, c and d; below 0: behind.
    heights: vec4<f32>,
    /// Twice the areas of these faces. Heights times areas are six times the volumes, in the proportions of the corners' weights.
    areas: vec4<f32>,
}

/// How far `p` is behind the plane of a triangle that is counter-clockwise from outside, and twice its area.
fn height_and_area(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    let area = length(cross(b - a, c - a));
    // (As a determinant of differences from p: near a corner, its error is small as well.)
    return vec2<f32>(dot(a - p, cross(b - p, c - p)) / max(area, 1e-36), area);
}

/// Where `p` is in a tetrahedron whose corners a, b, c are counter-clockwise as seen from d. Heights are exact to roundings of the coordinates also
/// where it has hardly any volume, which weights are not.
fn in_tetrahedron(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, d: vec3<f32>) -> InTetrahedron {
    let of_a = height_and_area(p, b, c, d);
    let of_b = height_and_area(p, a, d, c);
    let of_c = height_and_area(p, a, b, d);
    let of_d = height_and_area(p, a, c, b);
    return InTetrahedron(
        vec4<f32>(of_a.x, of_b.x, of_c.x, of_d.x),
        vec4<f32>(of_a.y, of_b.y, of_c.y, of_d.y),
    );
}

/// The share of `b` in the point of the segment from `a` to `b` that is nearest to `p`, in [0, 1].
fn nearest_on_segment(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>) -> f32 {
    let along = b - a;
    return clamp(dot(p - a, along) / max(dot(along, along), 1e-36), 0.0, 1.0);
}

/// Weights of the corners in the point of a triangle that is nearest to `p`; each is exactly 0 where it plays no part. After C. Ericson,
/// "Real-Time Collision Detection", 2004, 5.1.5.
fn nearest_on_triangle(p: vec3<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let ab = b - a;
    let ac = c - a;
    let to_a = p - a;
    let d1 = dot(ab, to_a);
    let d2 = dot(ac, to_a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return vec3<f32>(1.0, 0.0, 0.0);
    }
    let to_b = p - b;
    let d3 = dot(ab, to_b);
    let d4 = dot(ac, to_b);
    if d3 >= 0.0 && d4 <= d3 {
        return vec3<f32>(0.0, 1.0, 0.0);
    }
    let to_c = p - c;
    let d5 = dot(ab, to_c);
    let d6 = dot(ac, to_c);
    if d6 >= 0.0 && d5 <= d6 {
        return vec3<f32>(0.0, 0.0, 1.0);
    }
    let of_c = d1 * d4 - d3 * d2;
    if of_c <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let share = d1 / (d1 - d3);
        return vec3<f32>(1.0 - share, share, 0.0);
    }
    let of_b = d5 * d2 - d1 * d6;
    if of_b <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let share = d2 / (d2 - d6);
        return vec3<f32>(1.0 - share, 0.0, share);
    }
    let of_a = d3 * d6 - d5 * d4;
    if of_a <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return vec3<f32>(0.0, 1.0 - share, share);
    }
    return vec3<f32>(of_a, of_b, of_c) / (of_a + of_b + of_c);
}
