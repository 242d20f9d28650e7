// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sRGB transfer function: display-referred numbers in [0, 1] from linear ones, and back.
//!
//! IEC 61966-2-1:1999. The two pieces of the curve do not quite meet: at the threshold they
//! differ by 3e-8, below what f32 resolves there.
#define_import_path lucerna::color::srgb

/// Below this, encoded values are linear in the light.
const SRGB_THRESHOLD: f32 = 0.04045;
const LINEAR_THRESHOLD: f32 = 0.0031308;

/// sRGB numbers from linear light, for each component.
///
/// Meant for [0, 1]. Above 1 the curve continues, below 0 its linear piece does; there is no clamp.
/// Relative error below 6e-6.
fn srgb_from_linear(linear: vec3<f32>) -> vec3<f32> {
    let low = linear * 12.92;
    let high = 1.055 * pow(max(linear, vec3<f32>(LINEAR_THRESHOLD)), vec3<f32>(1.0 / 2.4)) - 0.055;
    return select(high, low, linear <= vec3<f32>(LINEAR_THRESHOLD));
}

/// Linear light from sRGB numbers, the inverse of [`srgb_from_linear`], over the same domain.
/// Relative error below 6e-6.
fn linear_from_srgb(srgb: vec3<f32>) -> vec3<f32> {
    let low = srgb / 12.92;
    let high = pow((max(srgb, vec3<f32>(SRGB_THRESHOLD)) + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, srgb <= vec3<f32>(SRGB_THRESHOLD));
}
