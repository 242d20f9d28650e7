// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points on a triangle.
#define_import_path lucerna::sampling::triangle

/// Barycentrics (weights of the second and third corner) of a uniformly distributed point.
///
/// E. Heitz, "A Low-Distortion Map Between Triangle and Square", 2019. `u` is uniform in [0, 1)²;
/// the density by area is 1/area.
fn sample_uniform_triangle(u: vec2<f32>) -> vec2<f32> {
    let half = 0.5 * u;
    let offset = half.y - half.x;
    // Above the diagonal the square is squeezed along one axis, below along the other.
    return select(vec2<f32>(half.x, u.y - half.x), vec2<f32>(u.x - half.y, half.y), offset < 0.0);
}
