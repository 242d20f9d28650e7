// SPDX-License-Identifier: MIT OR Apache-2.0
//! Host seam: drawing a light, and the density with which one would have been drawn.
//!
//! Interface: `LightSample`, `sample_light`, `pdf_of_emitter`, `pdf_of_sky`,
//! `lights_can_be_hit`. All densities are by solid angle and include the choice of the light.
#define_import_path lucerna::host::lights

#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::geometry::ray_offset::{interpolation_error, offset_ray_origin}
#import lucerna::host::scene::{scene, triangles, lights, materials, NONE, MATERIAL_DOUBLE_SIDED, TRIANGLE_ALPHA_TESTED}
#import lucerna::host::scene::{LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL, LIGHT_TRIANGLE, LIGHT_SKY}
#import lucerna::host::sky::{sample_sky, pdf_sky}
#import lucerna::host::surface::{emission_at, is_cut_away}
#import lucerna::light::punctual::{PunctualSample, sample_point_light, sample_spot_light, sample_directional_light}
#import lucerna::light::triangle::{sample_triangle_light, pdf_triangle_light, triangle_area_vector}
#import lucerna::math::constants::FLOAT_MAX

/// Light that may arrive at a point.
struct LightSample {
    /// Unit length, towards the light.
    direction: vec3<f32>,
    /// To `place` [m]; FLOAT_MAX: infinitely far.
    distance: f32,
    /// Where the light stands (unless infinitely far), already off its own surface.
    place: vec3<f32>,
    /// [sr⁻¹]; 0: a light without extent, that no other strategy finds.
    pdf: f32,
    /// What arrives, divided by the density: `f · cosine · weight` estimates reflected radiance.
    weight: vec3<f32>,
}

/// Draws one of the lights for a point. Nothing arrives where `weight` is zero.
///
/// `u`: uniform in [0, 1)⁴: x chooses an entry, y, z a place on it, w between entry and alias.
fn sample_light(at: vec3<f32>, u: vec4<f32>) -> LightSample {
    var out = LightSample(vec3<f32>(0.0, 1.0, 0.0), FLOAT_MAX, at, 0.0, vec3<f32>(0.0));
    if scene.n_lights == 0u {
        return out;
    }
    let entry = min(u32(u.x * f32(scene.n_lights)), scene.n_lights - 1u);
    let light_ix = select(lights[entry].alias_ix, entry, u.w < lights[entry].alias_threshold);
    // Field by field: a light is 80 bytes, and most kinds need few of them.
    let kind = lights[light_ix].kind;
    let probability = lights[light_ix].probability;
    if kind == LIGHT_TRIANGLE {
        return sample_emitter(lights[light_ix].triangle, at, u.yz, probability);
    }
    if kind == LIGHT_SKY {
        let drawn = sample_sky(u.yz);
        out.direction = drawn.direction;
        out.pdf = drawn.pdf * probability;
        if out.pdf > 0.0 {
            out.weight = drawn.radiance / out.pdf;
        }
        return out;
    }
    var found: PunctualSample;
    if kind == LIGHT_DIRECTIONAL {
        found = sample_directional_light(lights[light_ix].direction, lights[light_ix].intensity);
    } else if kind == LIGHT_POINT {
        found = sample_point_light(
            lights[light_ix].position,
            lights[light_ix].intensity,
            lights[light_ix].range,
            at,
        );
    } else if kind == LIGHT_SPOT {
        found = sample_spot_light(
            lights[light_ix].position,
            lights[light_ix].direction,
            lights[light_ix].intensity,
            lights[light_ix].range,
            lights[light_ix].spot_scale,
            lights[light_ix].spot_offset,
            at,
        );
    }
    out.direction = found.to_light;
    out.distance = found.distance;
    out.place = lights[light_ix].position;
    out.weight = found.normal_irradiance / probability;
    return out;
}

/// A point of an emissive triangle, uniform by area.
fn sample_emitter(triangle_ix: u32, at: vec3<f32>, u: vec2<f32>, probability: f32) -> LightSample {
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    let drawn = sample_triangle_light(a, b, c, at, u);
    var out = LightSample(drawn.to_light, drawn.distance, at, drawn.pdf * probability, vec3<f32>(0.0));
    let is_masked = (triangles[triangle_ix].flags & TRIANGLE_ALPHA_TESTED) != 0u;
    if is_masked && is_cut_away(triangle_ix, drawn.barycentrics) {
        return out;
    }
    let double_sided = (materials[triangles[triangle_ix].material].flags & MATERIAL_DOUBLE_SIDED) != 0u;
    if out.pdf > 0.0 && (drawn.cosine > 0.0 || double_sided) {
        out.weight = emission_at(triangle_ix, drawn.barycentrics) / out.pdf;
        out.place = offset_ray_origin(
            interpolate_vec3(a, b, c, drawn.barycentrics),
            interpolation_error(a, b, c),
            normalize(triangle_area_vector(a, b, c)),
            -drawn.to_light,
        );
    }
    return out;
}

/// The density with which [`sample_light`] would have drawn a point of an emissive triangle that a
/// ray has hit [sr⁻¹]. `direction`: of the ray, unit length; `distance`: to the point [m].
fn pdf_of_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    let light_ix = triangles[triangle_ix].light;
    if light_ix == NONE {
        return 0.0;
    }
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    return lights[light_ix].probability * pdf_triangle_light(a, b, c, direction, distance);
}

/// The density with which [`sample_light`] would have drawn a direction of the sky [sr⁻¹].
fn pdf_of_sky(direction: vec3<f32>) -> f32 {
    if scene.sky_light == NONE {
        return 0.0;
    }
    return lights[scene.sky_light].probability * pdf_sky(direction);
}

/// Whether a ray can find light by hitting it: an emissive surface or a sky.
fn lights_can_be_hit() -> bool {
    return scene.n_hittable_lights > 0u;
}
