// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: how much of a light a surface point sees: by shadow maps if the light has them, otherwise by a ray.
//!
//! Interface: `light_visibility`.
#define_import_path lucerna::scene::visibility

#import lucerna::fields::shadow_maps::{has_map, mapped_visibility}
#import lucerna::scene::shadow_rays::light_is_hidden
#import lucerna::scene::types::LightSample

/// Share of a light's radiation that arrives, in [0, 1]. `solid_angle` is not needed.
fn light_visibility(
    light: LightSample,
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
    solid_angle: f32,
) -> f32 {
    if has_map(light.ix) {
        return mapped_visibility(light.ix, position, normal);
    }
    return select(1.0, 0.0, light_is_hidden(light, position, position_error, normal));
}
