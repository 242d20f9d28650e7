// SPDX-License-Identifier: MIT OR Apache-2.0
//! Tests on the bits of an f32.
//!
//! WGSL lets a compiler assume that no value is NaN or infinite, so `x != x` may be folded to
//! `false`; the bits cannot be.
#define_import_path lucerna::math::float

/// Whether `x` is NaN, for any f32.
fn is_nan(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u;
}

/// Whether `x` is +∞ or −∞, for any f32.
fn is_infinite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7fffffffu) == 0x7f800000u;
}

/// Whether `x` is neither NaN nor infinite, for any f32.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

/// Whether all three components are finite.
fn all_finite(v: vec3<f32>) -> bool {
    let exponents = bitcast<vec3<u32>>(v) & vec3<u32>(0x7f800000u);
    return all(exponents != vec3<u32>(0x7f800000u));
}
