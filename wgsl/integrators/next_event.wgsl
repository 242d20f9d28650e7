// SPDX-License-Identifier: MIT OR Apache-2.0
//! Next-event estimation: what a surface receives or reflects of one drawn light.
//!
//! J. Kajiya, "The Rendering Equation", SIGGRAPH 1986 (a ray to a light at each point of a path); weighed against other ways to
//! find the same light by multiple importance sampling (E. Veach, L. Guibas, "Optimally Combining Sampling Techniques for
//! Monte Carlo Rendering", SIGGRAPH 1995, multi-sample power heuristic).
//!
//! Use: draw a light (`scene::lights`), ask what may arrive of it ([`reflected_of_light`], [`irradiance_of_light`]) and, where
//! `may_arrive` says so, how much of it is visible: by `scene::shadow_rays`, or by `scene::visibility` with
//! [`solid_angle_of_sample`]. The estimate is `visible · light · weight`.
//!
//! Bindings: none of its own; it asks the scene seam.
#define_import_path lucerna::integrators::next_event

#import lucerna::bsdf::scattering::{Scattering, evaluate_scattering, scattering_pdf}
#import lucerna::math::constants::INV_PI
#import lucerna::math::float::all_finite
#import lucerna::sampling::mis::power_heuristic
#import lucerna::scene::lights::{LightSample, sample_light}
#import lucerna::scene::shadow_rays::light_is_hidden
#import lucerna::scene::surface::Surface

/// What may arrive of a drawn light: before anything is known of shadows.
struct NextEvent {
    /// Irradiance [W·m⁻²] or reflected radiance [W·sr⁻¹·m⁻²], divided by the density of the draw.
    light: vec3<f32>,
    /// Of the draw against the other ways to find the light, in [0, 1]; 1: there is none.
    weight: f32,
    /// False: `light` is the answer whatever stands between. It is zero then, or not finite where the light is not.
    may_arrive: bool,
}

/// The weight of a drawn light against other ways that find it, in [0, 1].
///
/// `light_pdf`: of the draw, `other_pdf`: of the other way, each times its number of samples [sr⁻¹]. A light without extent
/// (`light_pdf` 0) is found by the draw alone.
fn next_event_weight(light_pdf: f32, other_pdf: f32) -> f32 {
    return select(power_heuristic(light_pdf, other_pdf), 1.0, light_pdf == 0.0);
}

/// What one sample of a light stands for [sr]; 0 for lights without extent (`pdf` 0). `pdf`: times the number of samples.
fn solid_angle_of_sample(pdf: f32) -> f32 {
    return select(0.0, 1.0 / pdf, pdf > 0.0);
}

/// What a surface reflects of a light.
///
/// `geometric_normal`: unit length, on the viewer's side; `world_from_local`: the frame of `scattering`.
/// `n_light`, `n_scattered`: samples that are drawn of lights and of reflections, both at least 0; `light.weight` is divided by
/// `n_light` already.
fn reflected_of_light(
    light: LightSample,
    geometric_normal: vec3<f32>,
    scattering: Scattering,
    world_from_local: mat3x3<f32>,
    n_light: f32,
    n_scattered: f32,
) -> NextEvent {
    let dark = NextEvent(vec3<f32>(0.0), 0.0, false);
    if !any(light.weight > vec3<f32>(0.0)) || dot(light.direction, geometric_normal) <= 0.0 {
        return dark;
    }
    let to_light = light.direction * world_from_local;
    let reflected = evaluate_scattering(scattering, to_light) * max(to_light.z, 0.0) * light.weight;
    if !any(reflected > vec3<f32>(0.0)) {
        return dark;
    }
    let pdf = scattering_pdf(scattering, to_light);
    return NextEvent(reflected, next_event_weight(light.pdf * n_light, pdf * n_scattered), true);
}

/// The irradiance on a surface by a light, weighed against the chance that one cosine-distributed ray finds it. Normals: unit
/// length, on the side that is asked about.
fn irradiance_of_light(light: LightSample, shading_normal: vec3<f32>, geometric_normal: vec3<f32>) -> NextEvent {
    let cosine = dot(light.direction, shading_normal);
    let irradiance = light.weight * max(cosine, 0.0);
    let is_below = dot(light.direction, geometric_normal) <= 0.0;
    if is_below || !any(irradiance > vec3<f32>(0.0)) {
        return NextEvent(select(irradiance, vec3<f32>(0.0), all_finite(irradiance)), 0.0, false);
    }
    return NextEvent(irradiance, next_event_weight(light.pdf, cosine * INV_PI), true);
}

/// rgb: what a surface reflects of one of the scene's lights, drawn, with a shadow ray [W·sr⁻¹·m⁻²]; a: the draw's weight against
/// one sample of the surface's own. `world_from_local`: the frame of `scattering`; `u`: uniform in [0, 1)⁴.
fn reflected_of_drawn_light(
    surface: Surface,
    scattering: Scattering,
    world_from_local: mat3x3<f32>,
    u: vec4<f32>,
) -> vec4<f32> {
    let light = sample_light(surface.position, u);
    let found = reflected_of_light(light, surface.geometric_normal, scattering, world_from_local, 1.0, 1.0);
    if !found.may_arrive {
        return vec4<f32>(0.0);
    }
    if light_is_hidden(light, surface.position, surface.position_error, surface.geometric_normal) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(found.light, found.weight);
}

/// Irradiance on a surface by one of the scene's lights, drawn, with a shadow ray [W·m⁻²], where nothing else looks for light.
/// `extended_only`: lights without extent give nothing. `u`: uniform in [0, 1)⁴.
fn irradiance_of_drawn_light(surface: Surface, u: vec4<f32>, extended_only: bool) -> vec3<f32> {
    let light = sample_light(surface.position, u);
    if extended_only && light.pdf == 0.0 {
        return vec3<f32>(0.0);
    }
    let found = irradiance_of_light(light, surface.shading_normal, surface.geometric_normal);
    if !found.may_arrive {
        return found.light;
    }
    let hidden = light_is_hidden(light, surface.position, surface.position_error, surface.geometric_normal);
    return select(found.light, vec3<f32>(0.0), hidden);
}
