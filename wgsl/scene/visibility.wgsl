// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: how much of a light a surface point sees.
//!
//! Interface: `light_visibility`. This one traces a ray; the variant `visibility=maps` uses shadow maps,
//! `visibility=cones` traces a cone through prefiltered voxels.
#define_import_path lucerna::scene::visibility

#import lucerna::scene::shadow_rays::light_is_hidden
#import lucerna::scene::types::LightSample

/// Share of a light's radiation that arrives, in [0, 1].
///
/// `position`, `position_error`: those of the lit point, as in `geometry::ray_offset` [m]; `normal`: geometric, unit
/// length. `solid_angle`: that which the sample represents [sr]; 0 for lights without extent.
fn light_visibility(
    light: LightSample,
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
    solid_angle: f32,
) -> f32 {
    return select(1.0, 0.0, light_is_hidden(light, position, position_error, normal));
}
