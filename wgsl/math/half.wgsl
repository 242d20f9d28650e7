// SPDX-License-Identifier: MIT OR Apache-2.0
//! Two numbers as two IEEE 754 binary16 ("half") floats in one word.
//!
//! `pack2x16float` alone is not enough: its result for numbers beyond the largest half is undefined, and drivers give
//! infinity, the largest half, or anything else. These functions clamp first.
#define_import_path lucerna::math::half

/// The largest finite half.
const HALF_MAX: f32 = 65504.0;

/// Two numbers as halves, x in the low bits.
///
/// Any f32: numbers beyond ±65504, including infinities, become ±65504, and NaN becomes 0. The error is below one unit
/// in the last place, 2⁻¹⁰ of the number (devices may round to either neighbour; most round to the nearest, 2⁻¹¹).
/// Below 2⁻¹⁴ the spacing is 2⁻²⁴, or a device flushes to 0.
fn pack_half(v: vec2<f32>) -> u32 {
    // On the bits, because the compiler may assume that there is no NaN and no infinity.
    let bits = bitcast<vec2<u32>>(v);
    let magnitude = bits & vec2<u32>(0x7fffffffu);
    let number = select(magnitude, vec2<u32>(0u), magnitude > vec2<u32>(0x7f800000u));
    let clamped = min(number, vec2<u32>(bitcast<u32>(HALF_MAX)));
    return pack2x16float(bitcast<vec2<f32>>(clamped | (bits & vec2<u32>(0x80000000u))));
}

/// The two numbers of [`pack_half`], exactly; subnormal halves may be flushed to 0. If it directly follows
/// [`pack_half`], some drivers (Mesa 25's lavapipe) remove both, and with them the rounding.
fn unpack_half(packed: u32) -> vec2<f32> {
    return unpack2x16float(packed);
}
