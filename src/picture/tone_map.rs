// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tone maps for pictures that go to a display.

use glam::Vec3;

/// A map from exposed linear radiance to linear display values in 0..1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneMap {
    /// [`khronos_pbr_neutral`].
    KhronosPbrNeutral,
}

impl ToneMap {
    /// Display value in 0..1 of an exposed linear value. See each function for its domain.
    #[must_use]
    pub fn apply(self, rgb: Vec3) -> Vec3 {
        match self {
            Self::KhronosPbrNeutral => khronos_pbr_neutral(rgb),
        }
    }
}

/// Fresnel reflectance at normal incidence, which the map subtracts from every colour.
const F90: f32 = 0.04;
/// Largest channel from which on highlights are compressed (linear).
const START_COMPRESSION: f32 = 0.8 - F90;
/// How fast compressed highlights lose their colour.
const DESATURATION: f32 = 0.15;

/// Khronos PBR Neutral (Khronos Group, "Khronos PBR Neutral Tone Mapper", 2024, specification §3).
///
/// Domain: linear Rec. 709, exposed; negative channels are taken as 0 and ∞ as the largest f32. Range: 0..1. Colours
/// whose channels are in 0.08..0.8 become 0.04 darker and otherwise stay the same.
#[must_use]
pub fn khronos_pbr_neutral(rgb: Vec3) -> Vec3 {
    let rgb = rgb.clamp(Vec3::ZERO, Vec3::MAX);
    let smallest = rgb.min_element();
    // 6.25 = 1 / (4 · F90): the parabola meets the constant with equal slope at 2 · F90.
    let offset =
        if smallest < 2.0 * F90 { smallest - smallest * smallest / (4.0 * F90) } else { F90 };
    let rgb = rgb - offset;
    let peak = rgb.max_element();
    if peak < START_COMPRESSION {
        return rgb;
    }
    let headroom = 1.0 - START_COMPRESSION;
    let new_peak = 1.0 - headroom * headroom / (peak + headroom - START_COMPRESSION);
    let rgb = rgb / peak * new_peak;
    let to_grey = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    rgb.lerp(Vec3::splat(new_peak), to_grey)
}
