// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tone mapping.
//!
//! Khronos PBR Neutral Tone Mapper (Khronos Group 2024, specification and constants as published):
//! leaves colours unchanged up to a peak of 0.8, so that a base colour under a white light of 1
//! looks as authored, then compresses and desaturates highlights.
#define_import_path lucerna::color::tonemap
#import lucerna::math::vector::{max_component, min_component}

/// Fresnel reflectance at normal incidence, subtracted so that a surface with base colour b and 4 %
/// of specular reflection becomes b.
const NEUTRAL_FRESNEL: f32 = 0.04;
/// The peak at which compression starts: 0.8 − NEUTRAL_FRESNEL.
const NEUTRAL_START: f32 = 0.76;
/// Speed of desaturation.
const NEUTRAL_DESATURATION: f32 = 0.15;

/// Display-referred linear RGB in [0, 1) of exposed linear Rec. 709 RGB.
///
/// `rgb`: components in [0, 1e37]. Continuous; hue is kept up to desaturation towards white.
/// Encode the result with `srgb_from_linear`.
fn tonemap_neutral(rgb: vec3<f32>) -> vec3<f32> {
    // A parabola up to 2 F, where it has reached F, its greatest; constant from there.
    let low = min(min_component(rgb), 2.0 * NEUTRAL_FRESNEL);
    let color = rgb - (low - low * low / (4.0 * NEUTRAL_FRESNEL));
    let peak = max_component(color);
    if peak < NEUTRAL_START {
        return color;
    }
    let headroom = 1.0 - NEUTRAL_START;
    let compressed_peak = 1.0 - headroom * headroom / (peak + headroom - NEUTRAL_START);
    // In this order nothing overflows.
    let compressed = color / peak * compressed_peak;
    let white_part = 1.0 - 1.0 / (NEUTRAL_DESATURATION * (peak - compressed_peak) + 1.0);
    return mix(compressed, vec3<f32>(compressed_peak), white_part);
}
