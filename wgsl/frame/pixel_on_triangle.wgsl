// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a pixel's ray hits the triangle that the rasteriser found there, and the pixel's footprint on it.
//!
//! T. Möller, B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", JGT 2(1), 1997: with s = o − a, e₁ = b −
//! a, e₂ = c − a the weights of b and c are (d·U)/(d·N) and (d·V)/(d·N), U = e₂ × s, V = s × e₁, N = e₂ × e₁. Their
//! derivatives over the picture follow by the quotient rule (H. Igehy, "Tracing Ray Differentials", 1999), so no
//! neighbouring pixel is needed, and control flow need not be uniform.
//!
//! The rasteriser's own depth is not used: it is interpolated between the corners with the rounding
//! of the *nearest* one (2⁻²⁴ of the near plane's depth, which 20 m from a near plane of 1 cm is
//! 2.4 mm). The point found here lies on the triangle's plane to f32's rounding at its own distance.
#define_import_path lucerna::frame::pixel_on_triangle

#import lucerna::camera::primary_ray::Camera

/// A pixel's sample on a triangle.
struct PixelOnTriangle {
    /// Weights of the second and third corner, inside the triangle.
    weights: vec2<f32>,
    /// Their change to the next pixel: xy to the right, zw down.
    spread: vec4<f32>,
}

/// `point`: of the picture, (0, 0) top left; `size` [pixels]. The rasteriser snaps corners to a grid, so the point may
/// be outside the triangle by a fraction of a pixel; then the nearest weights inside (by scaling) are returned.
fn pixel_on_triangle(
    camera: Camera,
    point: vec2<f32>,
    size: vec2<f32>,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
) -> PixelOnTriangle {
    let offset = camera.right * (2.0 * point.x - 1.0) + camera.up * (1.0 - 2.0 * point.y);
    let is_parallel = camera.orthographic != 0u;
    let direction = select(camera.forward + offset, camera.forward, is_parallel);
    let edge_b = b - a;
    let edge_c = c - a;
    let start = (camera.position - a) + select(vec3<f32>(0.0), offset, is_parallel);
    let toward_b = cross(edge_c, start);
    let toward_c = cross(start, edge_b);
    let normal = cross(edge_c, edge_b);
    let along = dot(direction, normal);
    if along == 0.0 {
        // Edge-on: the rasteriser found a sliver caused by its own snapping.
        return PixelOnTriangle(vec2<f32>(1.0 / 3.0), vec4<f32>(0.0));
    }
    let weights = vec2<f32>(dot(direction, toward_b), dot(direction, toward_c)) / along;
    let step_x = camera.right * (2.0 / size.x);
    let step_y = camera.up * (-2.0 / size.y);
    var spread: vec4<f32>;
    if is_parallel {
        spread = vec4<f32>(
            dot(direction, cross(edge_c, step_x)),
            dot(direction, cross(step_x, edge_b)),
            dot(direction, cross(edge_c, step_y)),
            dot(direction, cross(step_y, edge_b)),
        ) / along;
    } else {
        let turn_x = dot(step_x, normal);
        let turn_y = dot(step_y, normal);
        spread = vec4<f32>(
            dot(step_x, toward_b) - weights.x * turn_x,
            dot(step_x, toward_c) - weights.y * turn_x,
            dot(step_y, toward_b) - weights.x * turn_y,
            dot(step_y, toward_c) - weights.y * turn_y,
        ) / along;
    }
    let inside = max(vec3<f32>(1.0 - weights.x - weights.y, weights), vec3<f32>(0.0));
    // At least one of three weights with sum 1 is positive.
    return PixelOnTriangle(inside.yz / (inside.x + inside.y + inside.z), spread);
}
