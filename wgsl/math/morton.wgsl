// SPDX-License-Identifier: MIT OR Apache-2.0
//! Morton codes: cells of a grid in the order of a Z curve, the bits of the coordinates
//! interleaved, x lowest.
//!
//! G. M. Morton, "A Computer Oriented Geodetic Data Base", IBM 1966; bits spread by powers of
//! two as in H. S. Warren, "Hacker's Delight", 7-2.
#define_import_path lucerna::math::morton

/// The code of a cell, 16 bits of each coordinate; higher bits are ignored.
fn morton_encode_2d(cell: vec2<u32>) -> u32 {
    var v = cell & vec2<u32>(0xffffu);
    v = (v | (v << vec2<u32>(8u))) & vec2<u32>(0x00ff00ffu);
    v = (v | (v << vec2<u32>(4u))) & vec2<u32>(0x0f0f0f0fu);
    v = (v | (v << vec2<u32>(2u))) & vec2<u32>(0x33333333u);
    v = (v | (v << vec2<u32>(1u))) & vec2<u32>(0x55555555u);
    return v.x | (v.y << 1u);
}

/// The cell of [`morton_encode_2d`], for any code.
fn morton_decode_2d(code: u32) -> vec2<u32> {
    var v = vec2<u32>(code, code >> 1u) & vec2<u32>(0x55555555u);
    v = (v | (v >> vec2<u32>(1u))) & vec2<u32>(0x33333333u);
    v = (v | (v >> vec2<u32>(2u))) & vec2<u32>(0x0f0f0f0fu);
    v = (v | (v >> vec2<u32>(4u))) & vec2<u32>(0x00ff00ffu);
    v = (v | (v >> vec2<u32>(8u))) & vec2<u32>(0x0000ffffu);
    return v;
}

/// The code of a cell, 10 bits of each coordinate (codes below 2³⁰); higher bits are ignored.
fn morton_encode_3d(cell: vec3<u32>) -> u32 {
    var v = cell & vec3<u32>(0x3ffu);
    v = (v | (v << vec3<u32>(16u))) & vec3<u32>(0x030000ffu);
    v = (v | (v << vec3<u32>(8u))) & vec3<u32>(0x0300f00fu);
    v = (v | (v << vec3<u32>(4u))) & vec3<u32>(0x030c30c3u);
    v = (v | (v << vec3<u32>(2u))) & vec3<u32>(0x09249249u);
    return v.x | (v.y << 1u) | (v.z << 2u);
}

/// The cell of [`morton_encode_3d`]; the code's bits 30 and 31 are ignored.
fn morton_decode_3d(code: u32) -> vec3<u32> {
    var v = vec3<u32>(code, code >> 1u, code >> 2u) & vec3<u32>(0x09249249u);
    v = (v | (v >> vec3<u32>(2u))) & vec3<u32>(0x030c30c3u);
    v = (v | (v >> vec3<u32>(4u))) & vec3<u32>(0x0300f00fu);
    v = (v | (v >> vec3<u32>(8u))) & vec3<u32>(0x030000ffu);
    v = (v | (v >> vec3<u32>(16u))) & vec3<u32>(0x000003ffu);
    return v;
}
