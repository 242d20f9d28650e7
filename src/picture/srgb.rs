// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sRGB transfer function (IEC 61966-2-1:1999, with the constants as printed there).
//!
//! *Linear* is proportional to light, *encoded* is what an 8- or 16-bit file stores over its largest
//! value. The two pieces meet with a step of about 1e-8 at the printed thresholds.

use std::sync::LazyLock;

/// Below this (encoded), the curve is a line. IEC 61966-2-1, 5.2.
const ENCODED_THRESHOLD: f64 = 0.040_45;
/// Below this (linear), the curve is a line.
const LINEAR_THRESHOLD: f64 = 0.003_130_8;
/// Slope of the line, encoded over linear.
const SLOPE: f64 = 12.92;
/// Offset of the power curve.
const OFFSET: f64 = 0.055;
/// Exponent of the power curve.
const GAMMA: f64 = 2.4;

/// Linear value in 0..1 of an encoded value in 0..1. Domain: any value ≥ 0.
#[must_use]
pub fn linear_from_encoded(encoded: f64) -> f64 {
    if encoded <= ENCODED_THRESHOLD {
        encoded / SLOPE
    } else {
        ((encoded + OFFSET) / (1.0 + OFFSET)).powf(GAMMA)
    }
}

/// Encoded value in 0..1 of a linear value in 0..1. Domain: any value ≥ 0.
#[must_use]
pub fn encoded_from_linear(linear: f64) -> f64 {
    if linear <= LINEAR_THRESHOLD {
        linear * SLOPE
    } else {
        (1.0 + OFFSET) * linear.powf(1.0 / GAMMA) - OFFSET
    }
}

/// The byte that displays a linear value: clipped to 0..1, encoded, rounded to nearest. NaN becomes 0.
#[must_use]
pub fn byte_from_linear(linear: f64) -> u8 {
    (encoded_from_linear(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// Linear value of each byte.
pub(super) static LINEAR_FROM_BYTE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=u8::MAX).map(|b| linear_from_encoded(f64::from(b) / 255.0) as f32).collect()
});

/// Linear value of each 16-bit word.
#[cfg(any(feature = "jpeg", feature = "png"))]
pub(super) static LINEAR_FROM_WORD: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=u16::MAX).map(|w| linear_from_encoded(f64::from(w) / 65535.0) as f32).collect()
});

/// Linear value of a byte.
#[must_use]
pub fn linear_from_byte(byte: u8) -> f32 {
    LINEAR_FROM_BYTE[usize::from(byte)]
}
