// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: whether a surface point sees a light, by a ray.
//!
//! Interface: `light_is_hidden`. Exact in every variant, whereas `scene::visibility` may use maps or cones instead.
#define_import_path lucerna::scene::shadow_rays

#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::scene::rays::any_hit
#import lucerna::scene::types::{LightSample, ray_to_light}

/// Whether there is anything between a surface point and a light.
///
/// `position`, `position_error`: those of the lit point, as in `geometry::ray_offset` [m]; `normal`: geometric, unit
/// length.
fn light_is_hidden(
    light: LightSample,
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
) -> bool {
    let origin = offset_ray_origin(position, position_error, normal, light.direction);
    return any_hit(ray_to_light(light, origin));
}
