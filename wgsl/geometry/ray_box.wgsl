// SPDX-License-Identifier: MIT OR Apache-2.0
//! Ray–box intersection by slabs.
#define_import_path lucerna::geometry::ray_box

/// Components of a direction below this are treated as this.
const MIN_COMPONENT: f32 = 1e-20;
/// 2γ₃ = 6 roundings, rounded up.
const EXIT_SLACK: f32 = 3.6e-7;
/// Farther than any ray reaches.
const FAR: f32 = 1e38;

/// 1/direction with components below 1e-20 replaced by ±1e-20, so that no product with it is NaN
/// for coordinates up to 1e18.
fn safe_inverse_direction(direction: vec3<f32>) -> vec3<f32> {
    let size = max(abs(direction), vec3<f32>(MIN_COMPONENT));
    return select(vec3<f32>(1.0), vec3<f32>(-1.0), direction < vec3<f32>(0.0)) / size;
}

/// Where the line enters and leaves the box, in units of the direction's length: the box is hit if `x ≤ y` after both
/// are clipped to the ray's interval.
///
/// `inverse_direction`: from [`safe_inverse_direction`]. Conservative: a box that the exact ray
/// touches is never missed. T. Ize, "Robust BVH Ray Traversal", JCGT 2(2), 2013: the exit is enlarged
/// by the relative error 2γ₃. A ray that runs within a face or an edge is inside that slab for its
/// whole length, where a distance of 0 times any inverse would end it at 0.
fn intersect_box(
    origin: vec3<f32>,
    inverse_direction: vec3<f32>,
    box_min: vec3<f32>,
    box_max: vec3<f32>,
) -> vec2<f32> {
    let first = (box_min - origin) * inverse_direction;
    let second = (box_max - origin) * inverse_direction;
    // 0.5: the inverse of the least component is rounded.
    let parallel = abs(inverse_direction) > vec3<f32>(0.5 / MIN_COMPONENT);
    let runs_along = parallel & ((origin == box_min) | (origin == box_max));
    let near = select(min(first, second), vec3<f32>(-FAR), runs_along);
    let far = select(max(first, second), vec3<f32>(FAR), runs_along);
    let entry = max(near.x, max(near.y, near.z));
    let exit = min(far.x, min(far.y, far.z));
    return vec2<f32>(entry, exit + abs(exit) * EXIT_SLACK);
}
