// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where to start a ray that leaves a surface, so that it neither meets that surface again nor
//! skips what touches it.
//!
//! M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., §6.8.5–6.8.6: the
//! position's rounding error is bounded, and the start is moved along the normal out of the box of
//! that error.
#define_import_path lucerna::geometry::ray_offset

#import lucerna::math::constants::UNIT_ROUNDOFF

/// Bounds how far from the triangle's plane an interpolated point, or the intersection of a ray that
/// starts there, may lie by rounding [same unit as the corners; alike on all axes].
///
/// The interpolation has relative error γ₇ of the sum of absolute terms (pbrt eq. 6.26). The next
/// ray's distance to the same plane is a cancelling sum of products of coordinates relative to its
/// start, of whatever axis: its error is that of the *largest* coordinate, also on an axis on which
/// all corners are zero.
fn interpolation_error(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let largest = max(abs(a), max(abs(b), abs(c)));
    return vec3<f32>(32.0 * UNIT_ROUNDOFF * max(largest.x, max(largest.y, largest.z)));
}

/// Moves `position` off its surface to the side of `direction`.
///
/// `error`: per axis, from [`interpolation_error`]. `normal`: the geometric normal, unit length,
/// either side. `direction`: of the ray that will start here.
fn offset_ray_origin(
    position: vec3<f32>,
    error: vec3<f32>,
    normal: vec3<f32>,
    direction: vec3<f32>,
) -> vec3<f32> {
    let side = select(-normal, normal, dot(normal, direction) >= 0.0);
    // The error box reaches this far along the normal (pbrt eq. 6.28).
    let distance = dot(abs(normal), error);
    let moved = position + side * distance;
    // Rounding of the sum itself must not take the step back.
    return moved + sign(side) * abs(moved) * (2.0 * UNIT_ROUNDOFF);
}
