// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays against every quad.
#define_import_path lucerna::scene::rays

#import lucerna::scene::types::{Hit, NONE, Ray}
#import own::quads::quads

fn nearest_hit(ray: Ray) -> Hit {
    var nearest = Hit(ray.t_max, NONE, vec2<f32>(0.0));
    for (var ix = 0u; ix < arrayLength(&quads); ix++) {
        let quad = quads[ix];
        let normal = cross(quad.u, quad.v);
        let to_corner = quad.corner - ray.origin;
        let t = dot(to_corner, normal) / dot(ray.direction, normal);
        // (Also if the ray is parallel to the plane: t is NaN or infinite.)
        if !(t > ray.t_min && t < nearest.t) {
            continue;
        }
        let on_quad = t * ray.direction - to_corner;
        let place = vec2<f32>(dot(cross(on_quad, quad.v), normal), dot(cross(quad.u, on_quad), normal))
            / dot(normal, normal);
        if any(place < vec2<f32>(0.0)) || any(place > vec2<f32>(1.0)) {
            continue;
        }
        let is_odd = place.x + place.y > 1.0;
        nearest = Hit(t, 2u * ix + u32(is_odd), select(place, 1.0 - place, is_odd));
    }
    return nearest;
}

fn any_hit(ray: Ray) -> bool {
    return nearest_hit(ray).triangle != NONE;
}
