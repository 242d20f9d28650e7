// SPDX-License-Identifier: MIT OR Apache-2.0
//! Draws what a light sees into a layer of the shadow maps: only depths.
//!
//! Draw: 3·n triangles' vertices, one instance, no vertex buffers, no culling, depth test `greater` with writes and a
//! bias by slope (negative: away from the light, because depth is reversed). Light passes where a material's mask
//! removes a part.

#import lucerna::scene::triangles::{triangle_corners, triangle_is_masked}
#import lucerna::scene::surface::is_cut_away
#import lucerna::scene::types::corner_at
#import lucerna::components::shadow_maps::shadow_map::{ShadowView, shadow_clip}

@group(1) @binding(0) var<uniform> view: ShadowView;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) triangle: u32,
    @location(1) weights: vec2<f32>,
}

@vertex
fn corner(@builtin(vertex_index) vertex_ix: u32) -> Corner {
    let corner_ix = vertex_ix % 3u;
    let position = corner_at(triangle_corners(vertex_ix / 3u), corner_ix);
    let weights = vec2<f32>(select(0.0, 1.0, corner_ix == 1u), select(0.0, 1.0, corner_ix == 2u));
    return Corner(shadow_clip(view, position), vertex_ix / 3u, weights);
}

@fragment
fn mask(in: Corner) {
    let is_masked = triangle_is_masked(in.triangle);
    if is_masked && is_cut_away(in.triangle, in.weights) {
        discard;
    }
}
