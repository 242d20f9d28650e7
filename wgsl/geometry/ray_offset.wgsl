// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where to start a ray that leaves a surface, so that it neither hits that surface again nor skips what touches it.
//!
//! M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., §6.8.5–6.8.6: the
//! position's rounding error is bounded, and the start is moved along the normal out of the box of
//! that error.
#define_import_path lucerna::geometry::ray_offset

#import lucerna::math::constants::UNIT_ROUNDOFF

/// Roundings of the largest coordinate in an interpolated position: γ₇ (pbrt eq. 6.26), twice, for
/// the error of the barycentrics' third weight and of the normal.
const POSITION_ROUNDINGS: f32 = 16.0;
/// Roundings of the triangle's extent in the distance from its plane that an intersection with the *same* triangle
/// sees: its corners' shear mixes the axes, so even for a plane of constant coordinate, where the position is exact,
/// the hit can be off by this much. Enough for longest edge² up to 100 times twice the area; for thinner slivers, 1 ray
/// in 100 000 may hit its own triangle.
const PLANE_ROUNDINGS: f32 = 32.0;

/// Bounds, per axis, the rounding error of `a·(1−u−v) + b·u + c·v` and of the next ray's intersection
/// with that triangle [same unit as the corners].
fn interpolation_error(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let size = max(a, max(b, c)) - min(a, min(b, c));
    let extent = max(size.x, max(size.y, size.z));
    let position = POSITION_ROUNDINGS * max(abs(a), max(abs(b), abs(c)));
    return UNIT_ROUNDOFF * (position + PLANE_ROUNDINGS * extent);
}

/// Moves `position` off its surface to the side of `direction`.
///
/// `error`: per axis, from [`interpolation_error`]. `normal`: the geometric normal, unit length, either side.
/// `direction`: that of the ray that will start here.
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
    // Rounding of the sum itself must not undo the step.
    return moved + sign(side) * abs(moved) * (2.0 * UNIT_ROUNDOFF);
}
