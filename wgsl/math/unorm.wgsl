// SPDX-License-Identifier: MIT OR Apache-2.0
//! Four numbers in [0, 1] as four bytes (RGBA8 unorm), the layout of WebGPU's `rgba8unorm`.
#define_import_path lucerna::math::unorm

/// Four numbers as bytes, x in the lowest; each is clamped to [0, 1] and rounded to the nearest
/// multiple of 1/255 (a tie to either side). NaN gives an unspecified byte.
fn pack_unorm(v: vec4<f32>) -> u32 {
    return pack4x8unorm(v);
}

/// The four numbers of [`pack_unorm`], multiples of 1/255.
fn unpack_unorm(packed: u32) -> vec4<f32> {
    return unpack4x8unorm(packed);
}
