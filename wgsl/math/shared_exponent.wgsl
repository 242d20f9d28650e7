// SPDX-License-Identifier: MIT OR Apache-2.0
//! Three numbers ≥ 0 as 9-bit mantissas with one 5-bit exponent (RGB9E5, WebGPU's
//! `rgb9e5ufloat`).
//!
//! The algorithm of OpenGL's EXT_texture_shared_exponent, bit for bit. The number is mantissa · 2^(exponent − 24); x in
//! bits 0–8, y in 9–17, z in 18–26, the exponent in 27–31. 0x84020100 holds (1, 1, 1), for example.
#define_import_path lucerna::math::shared_exponent

/// The largest number, 511 · 2⁷.
const SHARED_EXPONENT_MAX: f32 = 65408.0;

/// Three numbers with one exponent, rounded to nearest, ties up.
///
/// Any f32: negative numbers and NaN become 0; numbers above 65408, including infinity, become 65408. The error of each
/// is at most 1/511 of the largest of the three and, if that is below 2⁻¹⁶, at most 2⁻²⁵.
fn pack_shared_exponent(v: vec3<f32>) -> u32 {
    // Bits of numbers ≥ 0 have the order of the numbers; those of negative numbers and NaN are above those of infinity.
    let raw = bitcast<vec3<u32>>(v);
    let number = select(raw, vec3<u32>(0u), raw > vec3<u32>(0x7f800000u));
    let bits = min(number, vec3<u32>(bitcast<u32>(SHARED_EXPONENT_MAX)));
    let clamped = bitcast<vec3<f32>>(bits);

    // max(−16, ⌊log₂ largest⌋) + 16, the exponent read from the bits.
    let largest = max(bits.x, max(bits.y, bits.z));
    var exponent = max(largest >> 23u, 111u) - 111u;
    if mantissa(bitcast<f32>(largest), exponent) == 512u {
        exponent += 1u;
    }
    return mantissa(clamped.x, exponent)
        | (mantissa(clamped.y, exponent) << 9u)
        | (mantissa(clamped.z, exponent) << 18u)
        | (exponent << 27u);
}

/// The three numbers of [`pack_shared_exponent`], exactly.
fn unpack_shared_exponent(packed: u32) -> vec3<f32> {
    let mantissas = vec3<u32>(packed, packed >> 9u, packed >> 18u) & vec3<u32>(0x1ffu);
    // 2^(exponent − 24).
    let scale = bitcast<f32>(((packed >> 27u) + 103u) << 23u);
    return vec3<f32>(mantissas) * scale;
}

/// ⌊x · 2^(24 − exponent) + ½⌋ in exact arithmetic: in f32 the sum may round up to the next integer.
fn mantissa(x: f32, exponent: u32) -> u32 {
    let scaled = x * bitcast<f32>((151u - exponent) << 23u);
    let whole = floor(scaled);
    return u32(whole) + select(0u, 1u, scaled - whole >= 0.5);
}
