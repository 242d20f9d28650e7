// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether a triangle and a box have a point in common.
//!
//! T. Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", JGT 6(1), 2001: the two are apart if
//! and only if their projections are on one of 13 axes.
#define_import_path lucerna::geometry::triangle_box

/// Whether the triangle overlaps the axis-aligned box `center` ± `half_size`, borders included.
///
/// Any triangles, also without area. In f32 the answer may be wrong if the gap or the overlap on the deciding axis is a
/// few 1e-7 of the coordinates relative to the box's centre; if all products are exact (small integers and halves),
/// touching counts.
fn triangle_overlaps_box(
    corner_a: vec3<f32>,
    corner_b: vec3<f32>,
    corner_c: vec3<f32>,
    center: vec3<f32>,
    half_size: vec3<f32>,
) -> bool {
    let a = corner_a - center;
    let b = corner_b - center;
    let c = corner_c - center;
    // The box's 3 normals.
    if any(min(a, min(b, c)) > half_size) || any(max(a, max(b, c)) < -half_size) {
        return false;
    }
    // The triangle's normal.
    let normal = cross(b - a, c - a);
    if abs(dot(normal, a)) > dot(half_size, abs(normal)) {
        return false;
    }
    // The 9 products of the box's axes and an edge at a time: the three components of p × edge are a point's
    // projections on (minus) those axes, and both ends of the edge have the same projection.
    var ends = array<vec3<f32>, 5>(a, b, c, a, b);
    for (var i = 0u; i < 3u; i++) {
        let edge = ends[i + 1u] - ends[i];
        let on_edge = cross(ends[i], edge);
        let opposite = cross(ends[i + 2u], edge);
        let size = abs(edge);
        let reach = half_size.yzx * size.zxy + half_size.zxy * size.yzx;
        if any(min(on_edge, opposite) > reach) || any(max(on_edge, opposite) < -reach) {
            return false;
        }
    }
    return true;
}
