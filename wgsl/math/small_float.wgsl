// SPDX-License-Identifier: MIT OR Apache-2.0
//! Three numbers ≥ 0 as floats of 11, 11 and 10 bits in one word (R11G11B10, WebGPU's
//! `rg11b10ufloat`).
//!
//! Each has 5 bits of exponent (bias 15), no sign, and 6 (x, y) or 5 (z) bits of mantissa; x in
//! bits 0–10, y in 11–21, z in 22–31. Khronos Data Format Specification 1.3, "Unsigned 11-bit" and
//! "Unsigned 10-bit floating-point numbers".
//! 0x781e03c0 holds (1, 1, 1), for example.
#define_import_path lucerna::math::small_float

/// The largest finite numbers: (2 − 2⁻⁶)·2¹⁵ and (2 − 2⁻⁵)·2¹⁵.
const SMALL_FLOAT_MAX: vec3<f32> = vec3<f32>(65024.0, 65024.0, 64512.0);
/// The smallest number with a full mantissa; spacing is even below.
const SMALL_FLOAT_MIN_NORMAL: f32 = 6.103515625e-5;
/// Additional mantissa bits of an f32.
const DROPPED_BITS: vec3<u32> = vec3<u32>(17u, 17u, 18u);
/// 1 / spacing below SMALL_FLOAT_MIN_NORMAL: 2²⁰ and 2¹⁹.
const SUBNORMAL_SCALE: vec3<f32> = vec3<f32>(1048576.0, 1048576.0, 524288.0);
/// The difference of the exponents' biases, 127 − 15, in place in an f32.
const REBIAS: u32 = 0x38000000u;

/// Three numbers as 11, 11 and 10 bits, rounded to nearest, ties to even.
///
/// Any f32: negative numbers and NaN become 0; numbers above the largest finite one, including
/// infinity, become that. From 2⁻¹⁴ on the error is at most 2⁻⁷ (x, y) and 2⁻⁶ (z) of the number;
/// below, at most 2⁻²¹ and 2⁻²⁰.
fn pack_small_float(v: vec3<f32>) -> u32 {
    // Bits of numbers ≥ 0 have the order of the numbers; those of negative numbers and NaN are
    // above those of infinity.
    let raw = bitcast<vec3<u32>>(v);
    let number = select(raw, vec3<u32>(0u), raw > vec3<u32>(0x7f800000u));
    let bits = min(number, bitcast<vec3<u32>>(SMALL_FLOAT_MAX));

    let odd = (bits >> DROPPED_BITS) & vec3<u32>(1u);
    let half = vec3<u32>(1u) << (DROPPED_BITS - vec3<u32>(1u));
    // Garbage if the number is subnormal, but not used in that case.
    let normal = (bits - vec3<u32>(REBIAS) + half - vec3<u32>(1u) + odd) >> DROPPED_BITS;
    let subnormal = vec3<u32>(round(bitcast<vec3<f32>>(bits) * SUBNORMAL_SCALE));
    let is_subnormal = bits < vec3<u32>(bitcast<u32>(SMALL_FLOAT_MIN_NORMAL));
    let packed = select(normal, subnormal, is_subnormal);
    return packed.x | (packed.y << 11u) | (packed.z << 22u);
}

/// The three numbers of [`pack_small_float`], exactly. A word from another source may hold infinity
/// (exponent 31, mantissa 0) or NaN (exponent 31, other mantissas).
fn unpack_small_float(packed: u32) -> vec3<f32> {
    let fields = vec3<u32>(packed & 0x7ffu, (packed >> 11u) & 0x7ffu, packed >> 22u);
    let exponent = fields >> vec3<u32>(6u, 6u, 5u);
    let subnormal = vec3<f32>(fields) / SUBNORMAL_SCALE;
    let rebiased = (fields << DROPPED_BITS) + vec3<u32>(REBIAS);
    let is_special = exponent == vec3<u32>(31u);
    let normal = select(rebiased, rebiased | vec3<u32>(0x7f800000u), is_special);
    return select(bitcast<vec3<f32>>(normal), subnormal, exponent == vec3<u32>(0u));
}
