// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light that emissive surfaces and the sky send along a ray, and how likely it is that sampling lights finds the same: for multiple importance sampling
//! (E. Veach, L. Guibas, 1995).
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::emitted_light

#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::scene::lights::{pdf_of_emitter, pdf_of_hittable_emitter, pdf_of_hittable_sky, pdf_of_sky}
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::sky::sky_radiance
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss, seen_from}

struct EmittedLight {
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
    /// Density with which a light sample has this direction [sr⁻¹].
    pdf: f32,
}

/// Along a direction of unit length from a surface. `hittable_only`: lights are sampled by `sample_hittable_light`, otherwise by `sample_light`.
fn emitted_light_along(
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
    direction: vec3<f32>,
    hittable_only: bool,
) -> EmittedLight {
    let origin = offset_ray_origin(position, position_error, normal, direction);
    let hit = nearest_hit(Ray(origin, 0.0, direction, FLOAT_MAX));
    if hit_is_miss(hit) {
        let pdf = select(pdf_of_sky(direction), pdf_of_hittable_sky(direction), hittable_only);
        return EmittedLight(sky_radiance(direction), pdf);
    }
    let radiance = seen_from(surface_at(hit.triangle, hit.barycentrics), direction).emission;
    let pdf = select(
        pdf_of_emitter(hit.triangle, direction, hit.t),
        pdf_of_hittable_emitter(hit.triangle, direction, hit.t),
        hittable_only,
    );
    return EmittedLight(radiance, pdf);
}
