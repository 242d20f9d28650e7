// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: the surface that a pixel of the picture sees. This one reads lucerna's G-buffer (`frame::gbuffer`).
//!
//! Interface: `view`, `pixel_surface`, `pixel_distance`, `pixel_triangle`. Its bindings are in group 2, separate from the scene's, so
//! that a renderer with its own G-buffer replaces only this module. `view` always has binding 0.
#define_import_path lucerna::scene::pixel

#import lucerna::frame::gbuffer::{GBufferSurface, GBufferTexels, decode_gbuffer}
#import lucerna::frame::view::FrameView

@group(2) @binding(0) var<uniform> view: FrameView;
@group(2) @binding(1) var albedo_texture: texture_2d<f32>;
@group(2) @binding(2) var normal_texture: texture_2d<u32>;
@group(2) @binding(3) var emission_texture: texture_2d<f32>;
@group(2) @binding(4) var depth_texture: texture_depth_2d;
@group(2) @binding(5) var triangle_texture: texture_2d<u32>;

/// The surface in a pixel, `pixel` < `view.size`.
fn pixel_surface(pixel: vec2<u32>) -> GBufferSurface {
    let texels = GBufferTexels(
        textureLoad(albedo_texture, pixel, 0),
        textureLoad(normal_texture, pixel, 0).xy,
        textureLoad(emission_texture, pixel, 0),
        textureLoad(depth_texture, pixel, 0),
    );
    return decode_gbuffer(view, pixel, texels);
}

/// Distance along the view axis to the surface in a pixel [m]; 0 if there is none.
fn pixel_distance(pixel: vec2<u32>) -> f32 {
    let depth = textureLoad(depth_texture, pixel, 0);
    return select(0.0, view.near / depth, depth > 0.0);
}

/// Index of the triangle in a pixel (`scene::triangles`); of a pixel without a surface, any number.
fn pixel_triangle(pixel: vec2<u32>) -> u32 {
    return textureLoad(triangle_texture, pixel, 0).x;
}
