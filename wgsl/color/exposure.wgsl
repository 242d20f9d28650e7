// SPDX-License-Identifier: MIT OR Apache-2.0
//! Exposure: the factor between scene-referred and display-referred linear light.
//!
//! EV100 as in S. Lagarde and C. de Rousiers, "Moving Frostbite to Physically Based Rendering",
//! SIGGRAPH course notes 2014: ISO 12232:2006 with the reflected-light meter constant K = 12.5 and
//! lens attenuation q = 0.65.
#define_import_path lucerna::color::exposure

/// The factor of an exposure compensation in stops: 2^ev. ev in [−126, 127].
fn exposure_scale(ev: f32) -> f32 {
    return exp2(ev);
}

/// The EV100 at which a meter exposes an average luminance (cd/m², above 0): log₂(L · 100 / 12.5).
fn ev_from_luminance(luminance: f32) -> f32 {
    return log2(luminance * 8.0);
}

/// The factor that scales the sensor's saturation luminance at an EV100, 1.2 · 2^EV100 cd/m² (78 /
/// (100 · q) times 2^EV100), to 1.
fn saturation_exposure(ev: f32) -> f32 {
    return exp2(-ev) / 1.2;
}
