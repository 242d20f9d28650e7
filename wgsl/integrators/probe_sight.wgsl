// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether a probe sees one side of a surface, or the sky: half of mutual visibility (A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination
//! by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG 36(6), 2017, eq. 6 with its checks of validity).
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::probe_sight

#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::scene::rays::any_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, Surface}

/// A point of a triangle, both normals on one side of it: 0 front, 1 back. `weights`: of the second and third corner.
fn sided_surface(triangle: u32, weights: vec2<f32>, side: u32) -> Surface {
    var surface = surface_at(triangle, weights);
    if side != 0u {
        surface.geometric_normal = -surface.geometric_normal;
        surface.shading_normal = -surface.shading_normal;
    }
    return surface;
}

/// Whether a probe sees the side of a surface to which its normals point: it is on that side, and nothing is in between.
fn probe_sees_surface(probe: vec3<f32>, surface: Surface) -> bool {
    let to_probe = probe - surface.position;
    if dot(to_probe, surface.geometric_normal) <= 0.0 {
        return false;
    }
    let origin = offset_ray_origin(surface.position, surface.position_error, surface.geometric_normal, to_probe);
    return !any_hit(Ray(origin, 0.0, probe - origin, 1.0));
}

/// Whether a probe sees the sky in a direction, unit length.
fn probe_sees_sky(probe: vec3<f32>, direction: vec3<f32>) -> bool {
    return !any_hit(Ray(probe, 0.0, direction, FLOAT_MAX));
}
