// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fills the G-buffer: all triangles of the scene, from either side.
//!
//! Draw: 3·n triangles' vertices, one instance, no vertex buffers (corners are pulled from the scene),
//! no culling, depth test `greater` with writes. Colour targets: albedo, normals, emission, motion, triangles
//! (`frame::gbuffer`). The fragment writes its depth, so triangles are tested after shading.

#import lucerna::frame::gbuffer::encode_gbuffer
#import lucerna::frame::pixel_on_triangle::pixel_on_triangle
#import lucerna::frame::view::{FrameView, clip_position, sampled_point, motion_at, view_direction}
#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::scene::triangles::{triangle_corners, triangle_is_masked}
#import lucerna::scene::surface::{filtered_surface_at, is_cut_away}
#import lucerna::scene::types::{corner_at, seen_from}

@group(1) @binding(0) var<uniform> view: FrameView;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat, either) triangle: u32,
}

@vertex
fn corner(@builtin(vertex_index) vertex_ix: u32) -> Corner {
    let position = corner_at(triangle_corners(vertex_ix / 3u), vertex_ix % 3u);
    return Corner(clip_position(view, position), vertex_ix / 3u);
}

struct Texels {
    @location(0) albedo: vec4<f32>,
    @location(1) normals: vec2<u32>,
    @location(2) emission: vec4<f32>,
    @location(3) motion: vec2<f32>,
    @location(4) triangle: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn surface(in: Corner) -> Texels {
    let pixel = vec2<u32>(in.position.xy);
    let point = sampled_point(view, pixel);
    let corners = triangle_corners(in.triangle);
    let at = pixel_on_triangle(view.camera, point, vec2<f32>(view.size), corners.a, corners.b, corners.c);
    let position = interpolate_vec3(corners.a, corners.b, corners.c, at.weights);
    let depth = dot(position - view.camera.position, view.camera.forward);
    let is_masked = triangle_is_masked(in.triangle);
    if depth < view.near || (is_masked && is_cut_away(in.triangle, at.weights)) {
        discard;
    }
    let found = seen_from(
        filtered_surface_at(in.triangle, at.weights, at.spread * view.footprint),
        view_direction(view, pixel),
    );
    let texels = encode_gbuffer(
        view,
        found.base_color,
        found.metallic,
        found.roughness,
        found.shading_normal,
        found.geometric_normal,
        found.emission,
        depth,
    );
    return Texels(
        texels.albedo,
        texels.normals,
        texels.emission,
        motion_at(view, position, point),
        in.triangle,
        texels.depth,
    );
}
