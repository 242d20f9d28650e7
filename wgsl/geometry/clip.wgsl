// SPDX-License-Identifier: MIT OR Apache-2.0
//! The part of a triangle inside a cube.
//!
//! I. Sutherland, G. Hodgman, "Reentrant Polygon Clipping", CACM 17(1), 1974: the polygon is cut by
//! one plane after the other. A cube has 6, each of which adds at most one corner.
#define_import_path lucerna::geometry::clip

#import lucerna::math::vector::max_component

/// The most corners of the part.
const CLIPPED_CORNERS: u32 = 9u;

/// A part of a triangle.
struct ClippedTriangle {
    /// Area times the unit normal, out of the front face; 0 if nothing is inside.
    area: vec3<f32>,
    /// The middle of the part's corners, which is within it; if nothing is inside, the middle of the cube.
    middle: vec3<f32>,
}

/// The part of the triangle in the cube `center` ± `half_size`, borders included.
///
/// Any triangle. Lengths and areas are in the coordinates' unit. For a cube of edge 1 the area's
/// error is below 3e-6 per axis where coordinates are at most 32 from the centre, and grows in
/// proportion from there.
fn clip_triangle_to_cube(
    corner_a: vec3<f32>,
    corner_b: vec3<f32>,
    corner_c: vec3<f32>,
    center: vec3<f32>,
    half_size: f32,
) -> ClippedTriangle {
    var polygon = array<vec3<f32>, CLIPPED_CORNERS>();
    polygon[0] = corner_a - center;
    polygon[1] = corner_b - center;
    polygon[2] = corner_c - center;
    var n = 3u;
    // A triangle inside needs no cut.
    let reach = max(abs(polygon[0]), max(abs(polygon[1]), abs(polygon[2])));
    if max_component(reach) > half_size {
        for (var plane = 0u; plane < 6u; plane++) {
            let axis = plane >> 1u;
            let sign = select(1.0, -1.0, (plane & 1u) != 0u);
            var kept = array<vec3<f32>, CLIPPED_CORNERS>();
            var n_kept = 0u;
            for (var k = 0u; k < n; k++) {
                let p = polygon[k];
                let q = polygon[select(k + 1u, 0u, k + 1u == n)];
                // Above 0: inside.
                let depth_p = half_size - sign * p[axis];
                let depth_q = half_size - sign * q[axis];
                // A convex polygon has at most 9 corners; rounding must not cause writes past them.
                if depth_p >= 0.0 && n_kept < CLIPPED_CORNERS {
                    kept[n_kept] = p;
                    n_kept += 1u;
                }
                if (depth_p >= 0.0) != (depth_q >= 0.0) && n_kept < CLIPPED_CORNERS {
                    var cut = mix(p, q, depth_p / (depth_p - depth_q));
                    cut[axis] = sign * half_size;
                    kept[n_kept] = cut;
                    n_kept += 1u;
                }
            }
            polygon = kept;
            n = n_kept;
        }
    }
    var clipped = ClippedTriangle(vec3<f32>(0.0), center);
    if n >= 3u {
        var sum = polygon[0];
        var area = vec3<f32>(0.0);
        for (var k = 1u; k < n; k++) {
            sum += polygon[k];
            if k + 1u < n {
                area += cross(polygon[k] - polygon[0], polygon[k + 1u] - polygon[0]);
            }
        }
        clipped.area = 0.5 * area;
        clipped.middle = center + sum / f32(n);
    }
    return clipped;
}
