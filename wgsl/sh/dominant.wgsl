// SPDX-License-Identifier: MIT OR Apache-2.0
//! The directional light that best approximates radiance given by SH.
//!
//! P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, "Extracting conventional
//! lights": the optimal linear direction is band 1 as a vector, of luminance for RGB; the
//! intensity is the least-squares fit of the light's own projection.
#define_import_path lucerna::sh::dominant
#import lucerna::color::luminance::luminance
#import lucerna::math::vector::safe_normalize
#import lucerna::sh::basis::{sh1_basis, sh2_basis}

/// Σ Yⱼ² over orders 1 and 2, the same in every direction: (l + 1)²/4π.
const SH1_POWER: f32 = 0.318309886183791;
const SH2_POWER: f32 = 0.716197243913529;

/// Band 1 of the luminance as a vector: it points to where most of the light comes from; its length
/// is √(3/4π) times the luminance of the radiance's first moment ∫ L ω dω. In world axes.
///
/// Takes coefficients 1, 2, 3 of any order.
fn sh_dominant_vector(y: vec3<f32>, z: vec3<f32>, x: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(luminance(x), luminance(y), luminance(z));
}

/// The unit direction to where most light comes from, weighted by luminance; `fallback` if there is
/// none (band 1 is below 1e-15: no light, or the same from all directions).
fn sh1_dominant_direction(radiance: array<vec3<f32>, 4>, fallback: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    return safe_normalize(sh_dominant_vector(c[1], c[2], c[3]), fallback);
}

/// [`sh1_dominant_direction`] of order 2; band 2 has no effect.
fn sh2_dominant_direction(radiance: array<vec3<f32>, 9>, fallback: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    return safe_normalize(sh_dominant_vector(c[1], c[2], c[3]), fallback);
}

/// The irradiance (W·m⁻², on a surface that faces it) of the light from a unit `direction` whose
/// projection E · Y(direction) is nearest to `radiance` (least squares), order 1.
fn sh1_directional_light(radiance: array<vec3<f32>, 4>, direction: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    var y = sh1_basis(direction);
    return (c[0] * y[0] + c[1] * y[1] + c[2] * y[2] + c[3] * y[3]) / SH1_POWER;
}

/// [`sh1_directional_light`] of order 2. Subtract E · Y(direction) from the coefficients to get the
/// remaining light.
fn sh2_directional_light(radiance: array<vec3<f32>, 9>, direction: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    var y = sh2_basis(direction);
    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < 9u; ix++) {
        sum += c[ix] * y[ix];
    }
    return sum / SH2_POWER;
}
