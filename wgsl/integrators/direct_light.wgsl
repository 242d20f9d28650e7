// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light on the surface in a pixel: light that arrives directly from a light, an emissive surface or the sky,
//! and is reflected towards the camera. `scene::visibility` provides the shadows.
//!
//! L = Σ f·cosθ·E over point, spot and directional lights, exactly, as long as there are no more than
//! [`MAX_EXACT_LIGHTS`]; and for all others an estimate by multiple importance sampling (E. Veach, L. Guibas,
//! "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, multi-sample power heuristic):
//! `n_light_samples` sample a light, `n_bsdf_samples` the BSDF.
//!
//! Samples are points of Owen-scrambled Sobol sequences (`sampling::low_discrepancy`), one stream per pixel, which
//! continue from frame to frame: the samples of a frame are stratified, and those of 2^k frames together as well.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::direct_light

#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::bsdf::scattering::{Scattering, scatter}
#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::integrators::emitted_light::emitted_light_along
#import lucerna::light::next_event::reflected_of_light
#import lucerna::scene::lights::{lights_can_be_hit, sample_hittable_light, sample_light}
#import lucerna::scene::lights::{n_punctual_lights, punctual_light}
#import lucerna::scene::visibility::light_visibility
#import lucerna::scene::types::LightSample
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::mis::{power_heuristic, solid_angle_of_sample}
#import lucerna::sampling::pcg::pcg3d

/// Numbers of samples of direct light.
struct DirectSettings {
    /// Samples of lights, per pixel and frame.
    n_light_samples: u32,
    /// Samples of the BSDF, per pixel and frame; they reduce the noise of bright, near lights and of reflections in
    /// glossy surfaces.
    n_bsdf_samples: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// Up to this many point, spot and directional lights, each one gets a shadow ray in every frame; if there are more,
/// they are sampled like the others.
const MAX_EXACT_LIGHTS: u32 = 16u;

/// Seeds of a sample's dimensions: the choice of a light, and of entry or alias; the place on the light; the
/// reflection's direction; its lobe.
const CHOICE: u32 = 0u;
const PLACE: u32 = 1u;
const REFLECTION: u32 = 2u;
const LOBE: u32 = 3u;

/// Radiance [W·sr⁻¹·m⁻²] that the surface reflects towards the camera.
///
/// `stream`: pixel (x, y) and seed; `frame`: counts frames. `surface.is_surface` must hold.
fn direct_light(
    surface: GBufferSurface,
    settings: DirectSettings,
    stream: vec3<u32>,
    frame: u32,
) -> vec3<f32> {
    let basis = frame_from_normal(surface.shading_normal);
    let scattering = Scattering(
        metallic_roughness(surface.albedo, surface.metallic, surface.roughness),
        surface.lambert,
        surface.to_viewer * basis,
    );
    let n_punctual = n_punctual_lights();
    let exact = n_punctual <= MAX_EXACT_LIGHTS;
    let n_exact = select(0u, n_punctual, exact);
    let has_drawn = lights_can_be_hit() || !exact;
    let n_drawn = select(0u, settings.n_light_samples, has_drawn);
    let n_scattered = select(0u, settings.n_bsdf_samples, lights_can_be_hit());
    let light_share = f32(n_drawn);
    let bsdf_share = f32(n_scattered);
    let seeds = pcg3d(stream);

    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < n_exact + n_drawn; ix++) {
        let is_exact = ix < n_exact;
        var light: LightSample;
        if is_exact {
            light = punctual_light(ix, surface.position);
        } else {
            let sample_ix = frame * n_drawn + (ix - n_exact);
            let choice = sobol_owen(sample_ix, seeds.x + CHOICE);
            let place = sobol_owen(sample_ix, seeds.x + PLACE);
            let u = vec4<f32>(choice.x, place, choice.y);
            if exact {
                light = sample_hittable_light(surface.position, u);
            } else {
                light = sample_light(surface.position, u);
            }
            light.weight /= light_share;
        }
        let found = reflected_of_light(
            light.direction,
            light.weight,
            light.pdf,
            surface.geometric_normal,
            scattering,
            basis,
            light_share,
            bsdf_share,
        );
        if !found.may_arrive {
            continue;
        }
        let visible = light_visibility(
            light,
            surface.position,
            surface.position_error,
            surface.geometric_normal,
            solid_angle_of_sample(light.pdf * light_share),
        );
        if visible > 0.0 {
            sum += visible * found.light * found.weight;
        }
    }

    for (var ix = 0u; ix < n_scattered; ix++) {
        let sample_ix = frame * n_scattered + ix;
        let u = sobol_owen(sample_ix, seeds.y + REFLECTION);
        let lobe = sobol_owen(sample_ix, seeds.y + LOBE).x;
        let drawn = scatter(scattering, vec3<f32>(u, lobe));
        let direction = basis * drawn.direction;
        if !(drawn.pdf > 0.0) || dot(direction, surface.geometric_normal) <= 0.0 {
            continue;
        }
        let found = emitted_light_along(
            surface.position,
            surface.position_error,
            surface.geometric_normal,
            direction,
            exact,
        );
        let weight = power_heuristic(drawn.pdf * bsdf_share, found.pdf * light_share);
        sum += drawn.weight * found.radiance * (weight / bsdf_share);
    }
    return sum;
}
