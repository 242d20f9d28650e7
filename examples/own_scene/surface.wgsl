// SPDX-License-Identifier: MIT OR Apache-2.0
//! Every quad is Lambertian, and none emits light.
#define_import_path lucerna::scene::surface

#import lucerna::geometry::barycentric::interpolate_vec3
#import lucerna::geometry::ray_offset::interpolation_error
#import lucerna::scene::triangles::triangle_corners
#import lucerna::scene::types::Surface
#import own::quads::quads

fn surface_at(triangle_ix: u32, weights: vec2<f32>) -> Surface {
    let corners = triangle_corners(triangle_ix);
    let normal = normalize(cross(corners.b - corners.a, corners.c - corners.a));
    var surface: Surface;
    surface.position = interpolate_vec3(corners.a, corners.b, corners.c, weights);
    surface.position_error = interpolation_error(corners.a, corners.b, corners.c);
    surface.geometric_normal = normal;
    surface.shading_normal = normal;
    surface.base_color = quads[triangle_ix / 2u].color;
    surface.roughness = 1.0;
    surface.lambert = true;
    return surface;
}
