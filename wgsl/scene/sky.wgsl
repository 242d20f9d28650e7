// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: light from infinitely far.
//!
//! Interface: `sky_radiance`, `SkySample`, `sample_sky`, `pdf_sky`. Measure: solid angle.
#define_import_path lucerna::scene::sky

#import lucerna::scene::data::{scene, sky_image, sky_distribution}
#import lucerna::light::sky::uv_from_direction
#import lucerna::math::constants::INV_FOUR_PI
#import lucerna::sampling::environment::{sample_environment, pdf_environment}
#import lucerna::sampling::sphere::sample_uniform_sphere

/// A direction towards the sky.
struct SkySample {
    /// Unit length, away from the surface.
    direction: vec3<f32>,
    /// [sr⁻¹]; 0: nothing there.
    pdf: f32,
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
}

/// Radiance that arrives from a direction (unit length, away from the surface), bilinear between
/// the image's texels.
fn sky_radiance(direction: vec3<f32>) -> vec3<f32> {
    if scene.sky_has_image == 0u {
        return scene.sky_radiance;
    }
    let size = vec2<i32>(scene.sky_size);
    let position = uv_from_direction(direction) * vec2<f32>(size) - 0.5;
    let base = floor(position);
    let weight = position - base;
    let y = clamp(vec2<i32>(i32(base.y), i32(base.y) + 1), vec2<i32>(0), vec2<i32>(size.y - 1));
    let x = (vec2<i32>(i32(base.x), i32(base.x) + 1) + size.x) % size.x;
    let upper = mix(
        textureLoad(sky_image, vec2<i32>(x.x, y.x), 0).rgb,
        textureLoad(sky_image, vec2<i32>(x.y, y.x), 0).rgb,
        weight.x,
    );
    let lower = mix(
        textureLoad(sky_image, vec2<i32>(x.x, y.y), 0).rgb,
        textureLoad(sky_image, vec2<i32>(x.y, y.y), 0).rgb,
        weight.x,
    );
    return scene.sky_radiance * mix(upper, lower, weight.y);
}

/// Draws a direction: uniform over the sphere for a constant sky, by the image's luminance else.
fn sample_sky(u: vec2<f32>) -> SkySample {
    if scene.sky_has_image == 0u {
        return SkySample(sample_uniform_sphere(u), INV_FOUR_PI, scene.sky_radiance);
    }
    let drawn = sample_environment(sky_distribution, scene.sky_size, u);
    return SkySample(drawn.direction, drawn.pdf, sky_radiance(drawn.direction));
}

/// The density with which [`sample_sky`] draws a direction [sr⁻¹].
fn pdf_sky(direction: vec3<f32>) -> f32 {
    if scene.sky_has_image == 0u {
        return INV_FOUR_PI;
    }
    return pdf_environment(sky_distribution, scene.sky_size, direction);
}
