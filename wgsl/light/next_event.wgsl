// SPDX-License-Identifier: MIT OR Apache-2.0
//! Next-event estimation without a scene: what a surface may receive or reflect from a light that was sampled for it.
//!
//! J. Kajiya, "The Rendering Equation", SIGGRAPH 1986 (a ray to a light at each point of a path); weighted against
//! other ways to find the same light by multiple importance sampling (E. Veach, L. Guibas, "Optimally Combining
//! Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, multi-sample power heuristic).
//!
//! Use: sample a light (`scene::lights`), compute what may arrive from it ([`reflected_of_light`],
//! [`irradiance_of_light`]) and, if `may_arrive`, how much of it is visible: by `scene::shadow_rays`, or by
//! `scene::visibility` with `sampling::mis::solid_angle_of_sample`. The estimate is `visible · light · weight`.
#define_import_path lucerna::light::next_event

#import lucerna::bsdf::scattering::{Scattering, evaluate_scattering, scattering_pdf}
#import lucerna::math::constants::INV_PI
#import lucerna::math::float::all_finite
#import lucerna::sampling::mis::next_event_weight

/// What may arrive from a sampled light, before shadows are known.
struct NextEvent {
    /// Irradiance [W·m⁻²] or reflected radiance [W·sr⁻¹·m⁻²], divided by the density of the sample.
    light: vec3<f32>,
    /// Weight of the sample against other ways to find the light, in [0, 1]; 1: there are none.
    weight: f32,
    /// False: `light` is the answer, with any shadows. It is zero then, or not finite because the light is not.
    may_arrive: bool,
}

/// The radiance that a surface reflects from a light.
///
/// `to_light`: unit length, world space; `sent`: the light's radiance divided by the density of the draw or, of lights
/// without extent, its irradiance on a surface that faces it [W·m⁻²]; `pdf`: the density [sr⁻¹], 0 of lights without
/// extent. `geometric_normal`: unit length, on the viewer's side; `world_from_local`: the frame of `scattering`.
/// `n_light`, `n_scattered`: numbers of light samples and of BSDF samples, both at least 0; `sent` is already divided
/// by `n_light`.
fn reflected_of_light(
    to_light: vec3<f32>,
    sent: vec3<f32>,
    pdf: f32,
    geometric_normal: vec3<f32>,
    scattering: Scattering,
    world_from_local: mat3x3<f32>,
    n_light: f32,
    n_scattered: f32,
) -> NextEvent {
    let dark = NextEvent(vec3<f32>(0.0), 0.0, false);
    if !any(sent > vec3<f32>(0.0)) || dot(to_light, geometric_normal) <= 0.0 {
        return dark;
    }
    let local = to_light * world_from_local;
    let reflected = evaluate_scattering(scattering, local) * max(local.z, 0.0) * sent;
    if !any(reflected > vec3<f32>(0.0)) {
        return dark;
    }
    let other_pdf = scattering_pdf(scattering, local);
    return NextEvent(reflected, next_event_weight(pdf * n_light, other_pdf * n_scattered), true);
}

/// The irradiance on a surface by a light, weighted against the chance that one cosine-distributed ray finds it.
/// `to_light`, `sent`, `pdf`: as in [`reflected_of_light`]; normals: unit length, on the lit side.
fn irradiance_of_light(
    to_light: vec3<f32>,
    sent: vec3<f32>,
    pdf: f32,
    shading_normal: vec3<f32>,
    geometric_normal: vec3<f32>,
) -> NextEvent {
    let cosine = dot(to_light, shading_normal);
    let irradiance = sent * max(cosine, 0.0);
    let is_below = dot(to_light, geometric_normal) <= 0.0;
    if is_below || !any(irradiance > vec3<f32>(0.0)) {
        return NextEvent(select(irradiance, vec3<f32>(0.0), all_finite(irradiance)), 0.0, false);
    }
    return NextEvent(irradiance, next_event_weight(pdf, cosine * INV_PI), true);
}
