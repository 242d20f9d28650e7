// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: rays that start at lights.
//!
//! Interface: `punctual_ray`, `extended_ray`. *Punctual* lights
//! are point, spot and directional, the first `scene.n_lights − scene.n_hittable_lights` entries;
//! *extended* ones are emissive triangles and the sky.
#define_import_path lucerna::scene::light_rays

#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::geometry::ray_offset::{interpolation_error, offset_ray_origin}
#import lucerna::scene::data::{scene, triangles, lights, material_at, MATERIAL_DOUBLE_SIDED}
#import lucerna::scene::data::{LIGHT_POINT, LIGHT_SPOT, LIGHT_TRIANGLE}
#import lucerna::scene::sky::sample_sky
#import lucerna::scene::types::LightRay
#import lucerna::light::triangle::triangle_area_vector
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::cone::sample_uniform_cone
#import lucerna::sampling::disc::sample_uniform_disc
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::sphere::sample_uniform_sphere
#import lucerna::sampling::triangle::sample_uniform_triangle

/// The ray of a punctual light. `u`: uniform in [0, 1)².
///
/// Point: uniform over the sphere. Spot: uniform over the solid angle of its outer cone.
/// Directional: parallel rays, uniform over the disc of the scene's bounding sphere.
fn punctual_ray(light_ix: u32, u: vec2<f32>) -> LightRay {
    let kind = lights[light_ix].kind;
    if kind == LIGHT_POINT {
        return LightRay(lights[light_ix].position, sample_uniform_sphere(u));
    }
    if kind == LIGHT_SPOT {
        // The falloff clamp(cos·scale + offset) is 0 from here on.
        let cos_outer = -lights[light_ix].spot_offset / lights[light_ix].spot_scale;
        let local = sample_uniform_cone(u, clamp(cos_outer, -1.0, 0.9999999));
        return LightRay(lights[light_ix].position, frame_from_normal(lights[light_ix].direction) * local);
    }
    return ray_from_far(lights[light_ix].direction, u);
}

/// A ray along `direction` (unit length) through the scene's bounding sphere, uniform over its disc.
fn ray_from_far(direction: vec3<f32>, u: vec2<f32>) -> LightRay {
    let center = 0.5 * (scene.bounds_min + scene.bounds_max);
    // A little more than half the diagonal, because rounding must not start a ray inside the scene.
    let radius = 0.5001 * length(scene.bounds_max - scene.bounds_min);
    let disc = radius * sample_uniform_disc(u);
    let across = frame_from_normal(direction) * vec3<f32>(disc, 0.0);
    return LightRay(center + across - radius * direction, direction);
}

/// A ray from the emissive triangles and the sky: a light sampled by its share of the power, a place by area, a
/// direction by the cosine; for the sky, a direction by its radiance and a place on the disc.
///
/// There must be such a light (`scene.n_hittable_lights` > 0). `u`, `v`: uniform in [0, 1)⁴.
/// `u.xy` gives the direction for triangles and the place on the sky's disc, `u.zw` the other one, `v.xy` chooses the
/// light, `v.z` the side of a double-sided triangle. (The probability of punctual lights goes evenly to the extended
/// ones.)
fn extended_ray(u: vec4<f32>, v: vec4<f32>) -> LightRay {
    let n_punctual = scene.n_lights - scene.n_hittable_lights;
    let entry = min(u32(v.x * f32(scene.n_lights)), scene.n_lights - 1u);
    var light_ix = select(lights[entry].alias_ix, entry, v.y < lights[entry].alias_threshold);
    if light_ix < n_punctual {
        light_ix = n_punctual
            + min(u32(v.w * f32(scene.n_hittable_lights)), scene.n_hittable_lights - 1u);
    }
    if lights[light_ix].kind != LIGHT_TRIANGLE {
        return ray_from_far(-sample_sky(u.zw).direction, u.xy);
    }
    let triangle_ix = lights[light_ix].triangle;
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    var normal = safe_normalize(triangle_area_vector(a, b, c), vec3<f32>(0.0, 1.0, 0.0));
    let double_sided = (material_at(triangles[triangle_ix].material).flags & MATERIAL_DOUBLE_SIDED) != 0u;
    if double_sided && v.z >= 0.5 {
        normal = -normal;
    }
    let direction = frame_from_normal(normal) * sample_cosine_hemisphere(u.xy);
    let place = interpolate_vec3(a, b, c, sample_uniform_triangle(u.zw));
    let origin = offset_ray_origin(place, interpolation_error(a, b, c), normal, direction);
    return LightRay(origin, direction);
}
