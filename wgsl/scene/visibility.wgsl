// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: how much of a light a surface point sees.
//!
//! Interface: `light_visibility`. This one traces a ray; the variant `shadow_map` looks into maps, `cone_shadow` follows
//! a cone through prefiltered voxels.
#define_import_path lucerna::scene::visibility

#import lucerna::scene::shadow_rays::light_is_hidden
#import lucerna::scene::types::LightSample

/// Share of what a light sends that arrives, in [0, 1].
///
/// `position`, `position_error`: of the lit point, as of `geometry::ray_offset` [m]; `normal`: geometric, unit length.
/// `solid_angle`: what the sample stands for [sr]; 0 for lights without extent.
fn light_visibility(
    light: LightSample,
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
    solid_angle: f32,
) -> f32 {
    return select(1.0, 0.0, light_is_hidden(light, position, position_error, normal));
}
