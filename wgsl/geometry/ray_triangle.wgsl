// SPDX-License-Identifier: MIT OR Apache-2.0
//! Watertight ray–triangle intersection.
//!
//! S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1), 2013: the corners are sheared so
//! that the ray runs along +Z from the origin; the triangle is hit if the origin is inside it in XY. Unlike the paper,
//! the signs of the edge functions come from a *comparison* of two rounded products, which a compiler cannot contract
//! into a fused multiply-add: rounding is monotonic, so the comparison never has the wrong sign (at worst it is a tie,
//! which counts as inside), and two triangles that share an edge compare the same products. No second pass in double
//! precision is needed.
#define_import_path lucerna::geometry::ray_triangle

#import lucerna::math::constants::FLOAT_MAX

/// A ray, prepared for any number of triangles.
struct ShearedRay {
    /// Start, in the space of the triangles.
    origin: vec3<f32>,
    /// The axis along which the direction is longest: 0, 1 or 2.
    axis: u32,
    /// Shear of X and Y by Z, and the scale of Z, after permutation.
    shear: vec3<f32>,
}

/// Where a ray hits a triangle.
struct TriangleHit {
    /// Distance in units of the direction's length; a miss has at least FLOAT_MAX and at least t_max.
    t: f32,
    /// Weights of the second and third corner, in [0, 1].
    barycentrics: vec2<f32>,
}

/// Turns the axis `axis` into Z and keeps the handedness.
fn permute(v: vec3<f32>, axis: u32) -> vec3<f32> {
    return select(select(v.xyz, v.zxy, axis == 1u), v.yzx, axis == 0u);
}

/// Prepares a ray. `direction`: finite, not zero; its length does not matter.
fn shear_ray(origin: vec3<f32>, direction: vec3<f32>) -> ShearedRay {
    let size = abs(direction);
    let axis = select(select(2u, 1u, size.y >= size.z), 0u, size.x >= size.y && size.x >= size.z);
    let d = permute(direction, axis);
    return ShearedRay(origin, axis, vec3<f32>(d.x / d.z, d.y / d.z, 1.0 / d.z));
}

/// Intersects a ray with a triangle from either side.
///
/// Hits with t in the open interval (`t_min`, `t_max`) count. A triangle of zero area, or one that
/// the ray runs along, is never hit.
fn intersect_triangle(
    ray: ShearedRay,
    corner_a: vec3<f32>,
    corner_b: vec3<f32>,
    corner_c: vec3<f32>,
    t_min: f32,
    t_max: f32,
) -> TriangleHit {
    let a = permute(corner_a - ray.origin, ray.axis);
    let b = permute(corner_b - ray.origin, ray.axis);
    let c = permute(corner_c - ray.origin, ray.axis);
    let p = a.xy - ray.shear.xy * a.z;
    let q = b.xy - ray.shear.xy * b.z;
    let r = c.xy - ray.shear.xy * c.z;

    let left = vec3<f32>(r.x * q.y, p.x * r.y, q.x * p.y);
    let right = vec3<f32>(r.y * q.x, p.y * r.x, q.y * p.x);
    var hit = TriangleHit(max(t_max, FLOAT_MAX), vec2<f32>(0.0));
    if all(left >= right) || all(left <= right) {
        let edges = left - right;
        let determinant = edges.x + edges.y + edges.z;
        if determinant != 0.0 {
            let inverse = 1.0 / determinant;
            let t = dot(edges, vec3<f32>(a.z, b.z, c.z)) * ray.shear.z * inverse;
            if t > t_min && t < t_max {
                hit.t = t;
                hit.barycentrics = clamp(edges.yz * inverse, vec2<f32>(0.0), vec2<f32>(1.0));
            }
        }
    }
    return hit;
}
