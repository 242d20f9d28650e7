// SPDX-License-Identifier: MIT OR Apache-2.0
//! No G-buffer: a ray finds the surface that a pixel sees.
#define_import_path lucerna::scene::pixel

#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::frame::view::{FrameView, view_direction}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss, seen_from}

@group(2) @binding(0) var<uniform> view: FrameView;

fn pixel_surface(pixel: vec2<u32>) -> GBufferSurface {
    let direction = view_direction(view, pixel);
    var out: GBufferSurface;
    out.to_viewer = -direction;
    let hit = nearest_hit(Ray(view.camera.position, 0.0, direction, FLOAT_MAX));
    if hit_is_miss(hit) {
        return out;
    }
    let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), direction);
    out.is_surface = true;
    out.lambert = surface.lambert;
    out.position = surface.position;
    out.depth = dot(surface.position - view.camera.position, view.camera.forward);
    out.position_error = surface.position_error;
    out.roughness = surface.roughness;
    out.geometric_normal = surface.geometric_normal;
    out.shading_normal = surface.shading_normal;
    out.albedo = surface.base_color;
    out.base_color = surface.base_color;
    return out;
}
