// SPDX-License-Identifier: MIT OR Apache-2.0
//! A probe as a sphere, to look at.
#define_import_path lucerna::components::probes::sphere

/// Radius of a sphere [units].
const SPHERE_RADIUS: f32 = 0.12;

/// Where a ray meets a probe's sphere.
struct SphereHit {
    probe: u32,
    /// [units]
    t: f32,
    /// Unit length.
    normal: vec3<f32>,
}

/// Where a ray enters a sphere around `center`; `t` is `end` if it does not before. `probe` is 0. All in units; `direction`: unit length.
fn sphere_hit(origin: vec3<f32>, direction: vec3<f32>, center: vec3<f32>, end: f32) -> SphereHit {
    let to_center = center - origin;
    let middle = dot(to_center, direction);
    // (From the nearest point of the ray, which rounds less than squares of distances.)
    let off = to_center - middle * direction;
    let apart = SPHERE_RADIUS * SPHERE_RADIUS - dot(off, off);
    let t = middle - sqrt(max(apart, 0.0));
    if apart > 0.0 && t > 0.0 && t < end {
        return SphereHit(0u, t, (t * direction - to_center) / SPHERE_RADIUS);
    }
    return SphereHit(0u, end, vec3<f32>(0.0));
}
