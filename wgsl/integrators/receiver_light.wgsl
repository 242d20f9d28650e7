// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance from lights on a point of a surface, for lightmaps: all point, spot and directional lights exactly, as long as there are no more than
//! [`MAX_EXACT_LIGHTS`]; and all others by multiple importance sampling (E. Veach, L. Guibas, 1995, power heuristic) of a few lights and a few
//! cosine-distributed rays, because an emitter that touches the surface is hardly ever drawn where it is nearest. `scene::visibility` provides the shadows.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::receiver_light

#import lucerna::integrators::direct_light::MAX_EXACT_LIGHTS
#import lucerna::integrators::emitted_light::emitted_light_along
#import lucerna::math::constants::{INV_PI, PI}
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::mis::{next_event_weight, power_heuristic, solid_angle_of_sample}
#import lucerna::sampling::pcg::{pcg, random_vec4}
#import lucerna::scene::lights::{lights_can_be_hit, n_punctual_lights, punctual_light, sample_hittable_light, sample_light}
#import lucerna::scene::types::{LightSample, Surface}
#import lucerna::scene::visibility::light_visibility

/// Samples of lights with an extent, or of all lights if there are too many; and rays that may find them.
const N_DRAWN: u32 = 4u;
const N_SCATTERED: u32 = 2u;

/// Irradiance [W·m⁻²] of an estimate. `surface`: normals on the lit side; `stream`: receiver, seed, frame.
fn light_on_receiver(surface: Surface, stream: vec3<u32>) -> vec3<f32> {
    let n_punctual = n_punctual_lights();
    let exact = n_punctual <= MAX_EXACT_LIGHTS;
    let n_exact = select(0u, n_punctual, exact);
    let n_drawn = select(0u, N_DRAWN, lights_can_be_hit() || !exact);
    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < n_exact + n_drawn; ix++) {
        var light: LightSample;
        if ix < n_exact {
            light = punctual_light(ix, surface.position);
        } else {
            let u = random_vec4(vec2<u32>(stream.x, pcg(stream.y)), stream.z, ix);
            if exact {
                light = sample_hittable_light(surface.position, u);
            } else {
                light = sample_light(surface.position, u);
            }
            light.weight /= f32(n_drawn);
        }
        let cosine = dot(light.direction, surface.shading_normal);
        if cosine <= 0.0 || dot(light.direction, surface.geometric_normal) <= 0.0 || !any(light.weight > vec3<f32>(0.0)) {
            continue;
        }
        let visible = light_visibility(
            light,
            surface.position,
            surface.position_error,
            surface.geometric_normal,
            solid_angle_of_sample(light.pdf * f32(n_drawn)),
        );
        if visible > 0.0 {
            let weight = next_event_weight(light.pdf * f32(n_drawn), cosine * INV_PI * f32(N_SCATTERED));
            sum += visible * cosine * weight * light.weight;
        }
    }
    if !lights_can_be_hit() {
        return sum;
    }
    for (var ix = 0u; ix < N_SCATTERED; ix++) {
        let u = random_vec4(vec2<u32>(stream.x, pcg(stream.y)), stream.z, n_exact + n_drawn + ix);
        let local = sample_cosine_hemisphere(u.xy);
        let direction = frame_from_normal(surface.shading_normal) * local;
        if dot(direction, surface.geometric_normal) <= 0.0 {
            continue;
        }
        let found = emitted_light_along(
            surface.position,
            surface.position_error,
            surface.geometric_normal,
            direction,
            exact,
        );
        // (Cosine over density is π.)
        let weight = power_heuristic(local.z * INV_PI * f32(N_SCATTERED), found.pdf * f32(n_drawn));
        sum += PI * found.radiance * (weight / f32(N_SCATTERED));
    }
    return sum;
}
