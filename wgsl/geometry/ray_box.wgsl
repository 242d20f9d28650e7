// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray–box intersection by slabs.
#define_import_path lucerna::geometry::ray_box

/// 1/direction with zeros replaced by ±1e-20, so that no product with it is NaN for coordinates
/// up to 1e18.
fn safe_inverse_direction(direction: vec3<f32>) -> vec3<f32> {
    let tiny = vec3<f32>(1e-20);
    let size = max(abs(direction), tiny);
    return select(vec3<f32>(1.0), vec3<f32>(-1.0), direction < vec3<f32>(0.0)) / size;
}

/// Where the line enters and leaves the box, in units of the direction's length: the box is met if
/// `x ≤ y` after both are clipped to the ray's interval.
///
/// `inverse_direction`: from [`safe_inverse_direction`]. Conservative: T. Ize, "Robust BVH Ray
/// Traversal", JCGT 2(2), 2013: the exit is enlarged by the relative error 2γ₃, so a box that the
/// exact ray touches is never missed.
fn intersect_box(
    origin: vec3<f32>,
    inverse_direction: vec3<f32>,
    box_min: vec3<f32>,
    box_max: vec3<f32>,
) -> vec2<f32> {
    let first = (box_min - origin) * inverse_direction;
    let second = (box_max - origin) * inverse_direction;
    let near = min(first, second);
    let far = max(first, second);
    let entry = max(near.x, max(near.y, near.z));
    let exit = min(far.x, min(far.y, far.z));
    return vec2<f32>(entry, exit + abs(exit) * 3.6e-7);
}
