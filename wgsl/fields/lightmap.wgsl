// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: where in the lightmap a point of a triangle is, and which receiver is there.
//!
//! Interface: `lightmap`, `lightmap_place`, `receiver_in_texel`, `receiver_at`, `texels_around`, `is_within_reach`.
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
/// the receiver there or NO_RECEIVER; then the same for the back side. Then, for each texel of both sides,
/// two masks: bits 0 to 15, which of 4 × 4 places in it no other surface separates from the point that stands for it, row by row; bits 16 to 23, which of
/// the eight texels around it, row by row from the upper left one.
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

/// Which texels around one inside the lightmap belong to the same surface and are not separated from it by another: bit (dy + 1)·3 + dx + 1 for the one
/// at (dx, dy), itself included.
fn texels_around(texel: vec2<u32>, side: u32) -> u32 {
    let links = texel_reach(texel, side) >> 16u;
    return (links & 0xfu) | 0x10u | ((links & 0xf0u) << 1u);
}

/// The masks of a texel inside the lightmap.
fn texel_reach(texel: vec2<u32>, side: u32) -> u32 {
    let n_texels = lightmap.size.x * lightmap.size.y;
    let ix = side * n_texels + texel.y * lightmap.size.x + texel.x;
    return lightmap_words[6u * lightmap.n_triangles + 2u * n_texels + ix];
}

/// Whether a place is on the same side of whatever cuts through its texel as the point that stands for the texel. `place`: within the lightmap [texels].
fn is_within_reach(place: vec2<f32>, side: u32) -> bool {
    let texel = min(vec2<u32>(place), lightmap.size - 1u);
    let inside = min(vec2<u32>((place - vec2<f32>(texel)) * 4.0), vec2<u32>(3u));
    return (texel_reach(texel, side) >> (inside.y * 4u + inside.x) & 1u) != 0u;
}

/// The receiver on the other side of what cuts through a place's texel: that of the nearest of the eight texels around it that are there; or NO_RECEIVER.
fn receiver_beside(place: vec2<f32>, side: u32) -> u32 {
    let own = min(vec2<u32>(place), lightmap.size - 1u);
    let around = texels_around(own, side);
    var found = NO_RECEIVER;
    var nearest = 1e9;
    for (var k = 0u; k < 9u; k++) {
        // (Texels beyond the left and upper border are beyond the right and lower one, too.)
        let at = own + vec2<u32>(k % 3u, k / 3u) - 1u;
        if (around >> k & 1u) != 0u || any(at >= lightmap.size) {
            continue;
        }
        let other = receiver_in_texel(at, side);
        let apart = distance(vec2<f32>(at) + 0.5, place);
        if other != NO_RECEIVER && apart < nearest {
            nearest = apart;
            found = other;
        }
    }
    return found;
}

/// The receiver at a point of a triangle, or NO_RECEIVER. Where something cuts through the texel, it is one on the point's side of that. `weights`: of the second and third corner; `side`: 0 front, 1 back.
fn receiver_at(triangle: u32, weights: vec2<f32>, side: u32) -> u32 {
    let place = lightmap_place(triangle, weights);
    if place.x < 0.0 {
        return NO_RECEIVER;
    }
    // (Rounding may leave a corner on the border.)
    let texel = min(vec2<u32>(place), lightmap.size - 1u);
    let receiver = receiver_in_texel(texel, side);
    if receiver == NO_RECEIVER || is_within_reach(place, side) {
        return receiver;
    }
    return receiver_beside(place, side);
}
