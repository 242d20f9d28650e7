// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: light from infinitely far away.
//!
//! Interface: `sky_radiance`, `sample_sky`, `pdf_sky`. Measure: solid angle.
#define_import_path lucerna::scene::sky

#import lucerna::scene::data::{scene, sky_image, sky_distribution}
#import lucerna::scene::types::SkySample
#import lucerna::sky::equirectangular::equirectangular_color
#import lucerna::math::constants::INV_FOUR_PI
#import lucerna::sky::environment::{sample_environment, pdf_environment}
#import lucerna::sampling::sphere::sample_uniform_sphere

/// Radiance that arrives from a direction (unit length, away from the surface), bilinear between
/// the image's texels.
fn sky_radiance(direction: vec3<f32>) -> vec3<f32> {
    if scene.sky_has_image == 0u {
        return scene.sky_radiance;
    }
    return scene.sky_radiance * equirectangular_color(sky_image, scene.sky_size, direction);
}

/// Samples a direction: uniformly over the sphere for a constant sky, otherwise by the image's
/// luminance.
fn sample_sky(u: vec2<f32>) -> SkySample {
    if scene.sky_has_image == 0u {
        return SkySample(sample_uniform_sphere(u), INV_FOUR_PI, scene.sky_radiance);
    }
    let drawn = sample_environment(sky_distribution, scene.sky_size, u);
    return SkySample(drawn.direction, drawn.pdf, sky_radiance(drawn.direction));
}

/// The density with which [`sample_sky`] samples a direction [sr⁻¹].
fn pdf_sky(direction: vec3<f32>) -> f32 {
    if scene.sky_has_image == 0u {
        return INV_FOUR_PI;
    }
    return pdf_environment(sky_distribution, scene.sky_size, direction);
}
