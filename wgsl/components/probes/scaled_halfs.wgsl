// SPDX-License-Identifier: MIT OR Apache-2.0
//! Numbers of any magnitude as halfs, with one exponent for all of a probe.
//!
//! Halfs alone end at 65 504, and lose precision below 6e-5: lights of a stadium and of a candle differ by more. Numbers are divided
//! by the power of two below the largest, so that all errors are relative to the largest: 2⁻¹¹ of it (2⁻¹⁰ on devices that do not
//! round to nearest).
#define_import_path lucerna::components::probes::scaled_halfs

/// The exponent for numbers up to `largest` ≥ 0, in [1, 253]. NaN and infinity count as the largest f32.
fn exponent_of(largest: f32) -> u32 {
    return clamp((bitcast<u32>(largest) >> 23u) & 255u, 1u, 253u);
}

/// What numbers are multiplied with before they are packed: the largest becomes less than 4.
fn packing_factor(exponent: u32) -> f32 {
    return bitcast<f32>((254u - exponent) << 23u);
}

/// The inverse of [`packing_factor`], exactly.
fn unpacking_factor(exponent: u32) -> f32 {
    return bitcast<f32>(exponent << 23u);
}
