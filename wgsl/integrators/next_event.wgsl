// SPDX-License-Identifier: MIT OR Apache-2.0
//! Next-event estimation: the light that a surface receives or reflects from one sampled light of the scene, with a
//! shadow ray.
//!
//! The estimate itself and its sources: `lucerna::light::next_event`.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::next_event

#import lucerna::bsdf::scattering::Scattering
#import lucerna::light::next_event::{NextEvent, irradiance_of_light, reflected_of_light}
#import lucerna::scene::lights::sample_light
#import lucerna::scene::shadow_rays::light_is_hidden
#import lucerna::scene::types::{LightSample, Surface}

/// rgb: radiance that a surface reflects from one sampled light of the scene, with a shadow ray [W·sr⁻¹·m⁻²]; a: the
/// light sample's weight against one BSDF sample. `world_from_local`: the frame of `scattering`; `u`: uniform in [0,
/// 1)⁴.
fn reflected_of_drawn_light(
    surface: Surface,
    scattering: Scattering,
    world_from_local: mat3x3<f32>,
    u: vec4<f32>,
) -> vec4<f32> {
    let light = sample_light(surface.position, u);
    let found = reflected_of_light(
        light.direction,
        light.weight,
        light.pdf,
        surface.geometric_normal,
        scattering,
        world_from_local,
        1.0,
        1.0,
    );
    if !found.may_arrive {
        return vec4<f32>(0.0);
    }
    if light_is_hidden(light, surface.position, surface.position_error, surface.geometric_normal) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(found.light, found.weight);
}

/// Irradiance on a surface by a sampled light of the scene if nothing is in between, weighted against the chance that a
/// cosine-distributed ray finds it (`lucerna::light::next_event::irradiance_of_light`).
fn irradiance_of_sample(surface: Surface, light: LightSample) -> NextEvent {
    return irradiance_of_light(
        light.direction,
        light.weight,
        light.pdf,
        surface.shading_normal,
        surface.geometric_normal,
    );
}

/// Irradiance on a surface by one sampled light of the scene, with a shadow ray [W·m⁻²], if nothing else samples
/// lights. `extended_only`: lights without extent give nothing. `u`: uniform in [0, 1)⁴.
fn irradiance_of_drawn_light(surface: Surface, u: vec4<f32>, extended_only: bool) -> vec3<f32> {
    let light = sample_light(surface.position, u);
    if extended_only && light.pdf == 0.0 {
        return vec3<f32>(0.0);
    }
    let found = irradiance_of_sample(surface, light);
    if !found.may_arrive {
        return found.light;
    }
    let hidden = light_is_hidden(light, surface.position, surface.position_error, surface.geometric_normal);
    return select(found.light, vec3<f32>(0.0), hidden);
}
