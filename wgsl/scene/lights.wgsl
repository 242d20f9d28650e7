// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: sampling a light, and the density with which one would have been sampled.
//!
//! Interface; of all lights: `sample_light`, `pdf_of_emitter`, `pdf_of_sky`,
//! `lights_can_be_hit`; of those that a ray can hit (emissive triangles and the sky) alone:
//! `sample_hittable_light`, `pdf_of_hittable_emitter`, `pdf_of_hittable_sky`; of the others (point, spot,
//! directional), one by one: `n_punctual_lights`, `punctual_light`. All densities are by solid angle
//! and include the choice of the light.
#define_import_path lucerna::scene::lights

#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::geometry::ray_offset::{interpolation_error, offset_ray_origin}
#import lucerna::scene::data::{scene, triangles, lights, material_at, MATERIAL_DOUBLE_SIDED, TRIANGLE_ALPHA_TESTED}
#import lucerna::scene::data::{LIGHT_POINT, LIGHT_SPOT, LIGHT_DIRECTIONAL, LIGHT_TRIANGLE, LIGHT_SKY}
#import lucerna::scene::sky::{sample_sky, pdf_sky}
#import lucerna::scene::surface::{emission_at, is_cut_away}
#import lucerna::scene::types::{Ray, NONE, LightSample}
#import lucerna::light::punctual::{PunctualSample, sample_point_light, sample_spot_light, sample_directional_light}
#import lucerna::light::triangle::{sample_triangle_light, pdf_triangle_light, triangle_area_vector}
#import lucerna::math::constants::FLOAT_MAX

/// Samples one of the lights for a point. If `weight` is zero, nothing arrives.
///
/// `u`: uniform in [0, 1)⁴: x chooses an entry, y, z a place on it, w between entry and alias.
fn sample_light(at: vec3<f32>, u: vec4<f32>) -> LightSample {
    if scene.n_lights == 0u {
        return no_light(at);
    }
    let entry = min(u32(u.x * f32(scene.n_lights)), scene.n_lights - 1u);
    let light_ix = select(lights[entry].alias_ix, entry, u.w < lights[entry].alias_threshold);
    let probability = lights[light_ix].probability;
    if light_ix >= scene.n_punctual_lights {
        return sample_hittable(light_ix, at, u.yz, probability);
    }
    var out = punctual_light(light_ix, at);
    out.weight /= probability;
    return out;
}

/// As [`sample_light`], but only among emissive triangles and the sky.
fn sample_hittable_light(at: vec3<f32>, u: vec4<f32>) -> LightSample {
    let n = scene.n_lights - scene.n_punctual_lights;
    if n == 0u {
        return no_light(at);
    }
    let entry = scene.n_punctual_lights + min(u32(u.x * f32(n)), n - 1u);
    let keep = u.w < lights[entry].hittable_threshold;
    let light_ix = select(lights[entry].hittable_alias_ix, entry, keep);
    return sample_hittable(light_ix, at, u.yz, lights[light_ix].hittable_probability);
}

/// Number of lights that [`punctual_light`] knows.
fn n_punctual_lights() -> u32 {
    return scene.n_punctual_lights;
}

/// The light that one of the lights without extent sends to a point, `ix` < [`n_punctual_lights`]: `weight` is the
/// irradiance on a surface that faces it [W·m⁻²], `pdf` is 0.
fn punctual_light(ix: u32, at: vec3<f32>) -> LightSample {
    // Read field by field, because a light is 80 bytes, and each kind needs only a few of them.
    let kind = lights[ix].kind;
    var found: PunctualSample;
    if kind == LIGHT_DIRECTIONAL {
        found = sample_directional_light(lights[ix].direction, lights[ix].intensity);
    } else if kind == LIGHT_POINT {
        found = sample_point_light(lights[ix].position, lights[ix].intensity, lights[ix].range, at);
    } else if kind == LIGHT_SPOT {
        found = sample_spot_light(
            lights[ix].position,
            lights[ix].direction,
            lights[ix].intensity,
            lights[ix].range,
            lights[ix].spot_scale,
            lights[ix].spot_offset,
            at,
        );
    }
    return LightSample(found.to_light, found.distance, lights[ix].position, 0.0, found.normal_irradiance, ix);
}

/// A sample without light.
fn no_light(at: vec3<f32>) -> LightSample {
    return LightSample(vec3<f32>(0.0, 1.0, 0.0), FLOAT_MAX, at, 0.0, vec3<f32>(0.0), NONE);
}

/// A place on the emissive triangle or the sky that was chosen with `probability`.
fn sample_hittable(light_ix: u32, at: vec3<f32>, u: vec2<f32>, probability: f32) -> LightSample {
    let kind = lights[light_ix].kind;
    if kind == LIGHT_TRIANGLE {
        return sample_emitter(lights[light_ix].triangle, at, u, probability);
    }
    var out = no_light(at);
    if kind != LIGHT_SKY {
        return out;
    }
    let drawn = sample_sky(u);
    out.direction = drawn.direction;
    out.pdf = drawn.pdf * probability;
    if out.pdf > 0.0 {
        out.weight = drawn.radiance / out.pdf;
    }
    return out;
}

/// A point of an emissive triangle, uniform by area.
fn sample_emitter(triangle_ix: u32, at: vec3<f32>, u: vec2<f32>, probability: f32) -> LightSample {
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    let drawn = sample_triangle_light(a, b, c, at, u);
    var out = LightSample(drawn.to_light, drawn.distance, at, drawn.pdf * probability, vec3<f32>(0.0), NONE);
    let is_masked = (triangles[triangle_ix].flags & TRIANGLE_ALPHA_TESTED) != 0u;
    if is_masked && is_cut_away(triangle_ix, drawn.barycentrics) {
        return out;
    }
    let double_sided = (material_at(triangles[triangle_ix].material).flags & MATERIAL_DOUBLE_SIDED) != 0u;
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

/// The density with which [`sample_light`] would have sampled a point of an emissive triangle that a ray has hit
/// [sr⁻¹]. `direction`: that of the ray, unit length; `distance`: to the point [m].
fn pdf_of_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    let light_ix = triangles[triangle_ix].light;
    if light_ix == NONE {
        return 0.0;
    }
    return lights[light_ix].probability * pdf_on_emitter(triangle_ix, direction, distance);
}

/// As [`pdf_of_emitter`], for [`sample_hittable_light`].
fn pdf_of_hittable_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    let light_ix = triangles[triangle_ix].light;
    if light_ix == NONE {
        return 0.0;
    }
    return lights[light_ix].hittable_probability * pdf_on_emitter(triangle_ix, direction, distance);
}

/// The density once the triangle has been chosen [sr⁻¹].
fn pdf_on_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    let a = triangles[triangle_ix].corner_a;
    let b = triangles[triangle_ix].corner_b;
    let c = triangles[triangle_ix].corner_c;
    return pdf_triangle_light(a, b, c, direction, distance);
}

/// The density with which [`sample_light`] would have sampled a direction of the sky [sr⁻¹].
fn pdf_of_sky(direction: vec3<f32>) -> f32 {
    if scene.sky_light == NONE {
        return 0.0;
    }
    return lights[scene.sky_light].probability * pdf_sky(direction);
}

/// As [`pdf_of_sky`], for [`sample_hittable_light`].
fn pdf_of_hittable_sky(direction: vec3<f32>) -> f32 {
    if scene.sky_light == NONE {
        return 0.0;
    }
    return lights[scene.sky_light].hittable_probability * pdf_sky(direction);
}

/// Whether a ray can find light by hitting it: an emissive surface or a sky.
fn lights_can_be_hit() -> bool {
    return scene.n_hittable_lights > 0u;
}
