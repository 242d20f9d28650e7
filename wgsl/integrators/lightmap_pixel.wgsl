// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where in the lightmap the surface in a pixel is.
//!
//! Bindings: none of its own; it uses the scene seam and the field `lightmap`.
#define_import_path lucerna::integrators::lightmap_pixel

#import lucerna::fields::lightmap::lightmap_place
#import lucerna::frame::pixel_on_triangle::pixel_on_triangle
#import lucerna::frame::view::sampled_point
#import lucerna::scene::pixel::{pixel_triangle, view}
#import lucerna::scene::triangles::triangle_corners

/// A place in the lightmap.
struct LightmapPlace {
    /// [texels]; below 0 if the triangle has no place in it.
    place: vec2<f32>,
    /// 0: the front of the triangle is seen; 1: its back.
    side: u32,
}

/// Of a pixel that sees a surface; `to_viewer`: unit length.
fn lightmap_place_of_pixel(pixel: vec2<u32>, to_viewer: vec3<f32>) -> LightmapPlace {
    let triangle = pixel_triangle(pixel);
    let corners = triangle_corners(triangle);
    let point = sampled_point(view, pixel);
    let at = pixel_on_triangle(view.camera, point, vec2<f32>(view.size), corners.a, corners.b, corners.c);
    let normal = cross(corners.b - corners.a, corners.c - corners.a);
    return LightmapPlace(lightmap_place(triangle, at.weights), u32(dot(normal, to_viewer) < 0.0));
}
