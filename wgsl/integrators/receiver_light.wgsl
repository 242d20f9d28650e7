// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance from lights on a point of a surface, for lightmaps: all point, spot and directional lights exactly, as long as there are no more than
//! [`MAX_EXACT_LIGHTS`], and a few samples of all others. `scene::visibility` provides the shadows.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::receiver_light

#import lucerna::integrators::direct_light::MAX_EXACT_LIGHTS
#import lucerna::sampling::mis::solid_angle_of_sample
#import lucerna::sampling::pcg::{pcg, random_vec4}
#import lucerna::scene::lights::{lights_can_be_hit, n_punctual_lights, punctual_light, sample_hittable_light, sample_light}
#import lucerna::scene::types::{LightSample, Surface}
#import lucerna::scene::visibility::light_visibility

/// Samples of lights with an extent, or of all lights if there are too many.
const N_DRAWN: u32 = 4u;

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
            sum += visible * cosine * light.weight;
        }
    }
    return sum;
}
