// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points that rays from lights or the camera find: the first surface point on a ray, and its irradiance.
//!
//! * [`lit_by_punctual`]: rays start at a light; E = I·cosθ/d² (point, spot) or E = E⊥·cosθ (directional), as T.
//!   Magalhães, "Real-Time Ray Traced Voxel Global Illumination", University of Porto, 2020.
//! * [`lit_by_extended`]: rays start at the emissive triangles and the sky, all at once. The ray only chooses the
//!   place: E there comes from another sampled light with a shadow ray, which does not need the area of the surface (a
//!   photon estimate would).
//! * [`lit_in_view`]: rays start at the camera; E comes from one sampled light of any kind with a shadow ray.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::injection

#import lucerna::camera::primary_ray::{Camera, primary_ray}
#import lucerna::integrators::next_event::irradiance_of_drawn_light
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::scene::light_rays::{extended_ray, punctual_ray}
#import lucerna::scene::lights::punctual_light
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss, Surface, seen_from}

/// A point that a ray has lit.
struct LitPoint {
    /// False: the ray hit nothing, and everything else is zero.
    is_surface: bool,
    /// [m]
    position: vec3<f32>,
    /// Geometric normal, unit length, on the side that the ray came from.
    normal: vec3<f32>,
    /// [W·m⁻²]
    irradiance: vec3<f32>,
}

/// The first surface on a ray.
struct FirstSurface {
    is_surface: bool,
    surface: Surface,
}

/// The first surface on a ray, seen from the ray's side. `direction`: unit length.
fn first_surface(origin: vec3<f32>, direction: vec3<f32>) -> FirstSurface {
    var out: FirstSurface;
    let hit = nearest_hit(Ray(origin, 0.0, direction, FLOAT_MAX));
    if !hit_is_miss(hit) {
        out.is_surface = true;
        out.surface = seen_from(surface_at(hit.triangle, hit.barycentrics), direction);
    }
    return out;
}

/// The point lit by a ray of a light without extent, `light_ix` < `scene::lights::n_punctual_lights()`. `u`: uniform in
/// [0, 1)².
fn lit_by_punctual(light_ix: u32, u: vec2<f32>) -> LitPoint {
    let ray = punctual_ray(light_ix, u);
    let found = first_surface(ray.origin, ray.direction);
    if !found.is_surface {
        return LitPoint();
    }
    let surface = found.surface;
    let light = punctual_light(light_ix, surface.position);
    let irradiance = light.weight * max(dot(surface.shading_normal, light.direction), 0.0);
    return LitPoint(true, surface.position, surface.geometric_normal, irradiance);
}

/// The point lit by a ray of the emissive triangles and the sky; there must be such a light. `u`, `v`: for
/// `scene::light_rays::extended_ray`; `w`: for the other sampled light; all uniform in [0, 1)⁴.
fn lit_by_extended(u: vec4<f32>, v: vec4<f32>, w: vec4<f32>) -> LitPoint {
    let ray = extended_ray(u, v);
    let found = first_surface(ray.origin, ray.direction);
    if !found.is_surface {
        return LitPoint();
    }
    let irradiance = irradiance_of_drawn_light(found.surface, w, true);
    return LitPoint(true, found.surface.position, found.surface.geometric_normal, irradiance);
}

/// The point that a camera sees. `point`: of the picture, (0, 0) top left; `u`: for the sampled light, uniform in [0,
/// 1)⁴.
fn lit_in_view(camera: Camera, point: vec2<f32>, u: vec4<f32>) -> LitPoint {
    let ray = primary_ray(camera, point);
    let found = first_surface(ray.origin, ray.direction);
    if !found.is_surface {
        return LitPoint();
    }
    let irradiance = irradiance_of_drawn_light(found.surface, u, false);
    return LitPoint(true, found.surface.position, found.surface.geometric_normal, irradiance);
}
