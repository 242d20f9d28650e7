// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: where in the lightmap a point of a triangle is, and which receiver is there.
//!
//! Interface: `lightmap`, `lightmap_place`, `receiver_in_texel`, `receiver_at`.
#define_import_path lucerna::fields::lightmap

/// No receiver.
const NO_RECEIVER: u32 = 0xffffffffu;

struct Lightmap {
    /// [texels]
    size: vec2<u32>,
    n_triangles: u32,
    n_receivers: u32,
}

@group(3) @binding(40) var<uniform> lightmap: Lightmap;
/// For each triangle, the places of its three corners, x and y [texels, f32]; zeros if it has none. Then, for each texel of the front side, row by row,
/// the receiver there or NO_RECEIVER; then the same for the back side.
@group(3) @binding(41) var<storage, read> lightmap_words: array<u32>;

/// A point's place in the lightmap [texels]; below 0 if its triangle has none. `weights`: of the second and third corner.
fn lightmap_place(triangle: u32, weights: vec2<f32>) -> vec2<f32> {
    if triangle >= lightmap.n_triangles {
        return vec2<f32>(-1.0);
    }
    let a = lightmap_corner(triangle, 0u);
    let b = lightmap_corner(triangle, 1u);
    let c = lightmap_corner(triangle, 2u);
    if all(a == b) && all(a == c) {
        return vec2<f32>(-1.0);
    }
    return a + weights.x * (b - a) + weights.y * (c - a);
}

/// The place of a corner [texels].
fn lightmap_corner(triangle: u32, corner: u32) -> vec2<f32> {
    let at = 6u * triangle + 2u * corner;
    return bitcast<vec2<f32>>(vec2<u32>(lightmap_words[at], lightmap_words[at + 1u]));
}

/// The receiver of a texel inside the lightmap, or NO_RECEIVER. `side`: 0 front, 1 back.
fn receiver_in_texel(texel: vec2<u32>, side: u32) -> u32 {
    let first = 6u * lightmap.n_triangles + side * lightmap.size.x * lightmap.size.y;
    return lightmap_words[first + texel.y * lightmap.size.x + texel.x];
}

/// The receiver at a point of a triangle, or NO_RECEIVER. `weights`: of the second and third corner; `side`: 0 front, 1 back.
fn receiver_at(triangle: u32, weights: vec2<f32>, side: u32) -> u32 {
    let place = lightmap_place(triangle, weights);
    if place.x < 0.0 {
        return NO_RECEIVER;
    }
    // (Rounding may leave a corner on the border.)
    let texel = min(vec2<u32>(place), lightmap.size - 1u);
    return receiver_in_texel(texel, side);
}
