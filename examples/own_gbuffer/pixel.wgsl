// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surface that a pixel sees, from the renderer's own G-buffer.
#define_import_path lucerna::scene::pixel

#import lucerna::camera::primary_ray::point_at_depth
#import lucerna::frame::gbuffer::{GBufferSurface, position_error}
#import lucerna::frame::view::{FrameView, sampled_point, view_direction}

@group(2) @binding(0) var<uniform> view: FrameView;
@group(2) @binding(1) var own_albedo: texture_2d<f32>;
@group(2) @binding(2) var own_normal: texture_2d<f32>;
@group(2) @binding(3) var own_distance: texture_2d<f32>;

fn pixel_surface(pixel: vec2<u32>) -> GBufferSurface {
    var surface: GBufferSurface;
    surface.to_viewer = -view_direction(view, pixel);
    let distance = textureLoad(own_distance, pixel, 0).x;
    if distance <= 0.0 {
        return surface;
    }
    surface.is_surface = true;
    surface.lambert = true;
    surface.depth = distance;
    surface.position = point_at_depth(view.camera, sampled_point(view, pixel), distance);
    surface.position_error = vec3<f32>(position_error(view, surface.position, distance));
    surface.geometric_normal = normalize(2.0 * textureLoad(own_normal, pixel, 0).xyz - 1.0);
    surface.shading_normal = surface.geometric_normal;
    surface.albedo = textureLoad(own_albedo, pixel, 0).rgb;
    surface.base_color = surface.albedo;
    surface.roughness = 1.0;
    return surface;
}
