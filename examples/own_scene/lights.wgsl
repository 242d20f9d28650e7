// SPDX-License-Identifier: MIT OR Apache-2.0
//! One lamp without extent: it is every sampled light, and no ray hits it.
#define_import_path lucerna::scene::lights

#import lucerna::light::punctual::sample_point_light
#import lucerna::scene::types::LightSample
#import own::quads::lamp

fn n_punctual_lights() -> u32 {
    return 1u;
}

fn punctual_light(ix: u32, at: vec3<f32>) -> LightSample {
    let drawn = sample_point_light(lamp.position, lamp.intensity, 0.0, at);
    return LightSample(drawn.to_light, drawn.distance, lamp.position, 0.0, drawn.normal_irradiance, ix);
}

fn sample_light(at: vec3<f32>, u: vec4<f32>) -> LightSample {
    return punctual_light(0u, at);
}

fn sample_hittable_light(at: vec3<f32>, u: vec4<f32>) -> LightSample {
    return LightSample();
}

fn lights_can_be_hit() -> bool {
    return false;
}

fn pdf_of_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    return 0.0;
}

fn pdf_of_hittable_emitter(triangle_ix: u32, direction: vec3<f32>, distance: f32) -> f32 {
    return 0.0;
}

fn pdf_of_sky(direction: vec3<f32>) -> f32 {
    return 0.0;
}

fn pdf_of_hittable_sky(direction: vec3<f32>) -> f32 {
    return 0.0;
}
