// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: how much of a light a surface point sees, by a cone through prefiltered voxels: soft shadows of lights with
//! extent from few samples (C. Crassin et al., "Interactive Indirect Illumination Using Voxel Cone Tracing", 2011).
//!
//! Interface: `light_visibility`.
#define_import_path lucerna::scene::visibility

#import lucerna::cone::march::{Cone, ConeSettings, cells_across, spread_of_solid_angle}
#import lucerna::fields::cone_trace::trace_cone
#import lucerna::fields::pyramid_layout::finest_cell
#import lucerna::scene::types::LightSample

/// How cones towards lights are followed: fine steps, for a shadow's edge is seen.
const SHADOW_STEPPING: ConeSettings = ConeSettings(0.5, -0.4, 0.95, 1.5);
/// Cones end so many cells, and so many of their widths, before the light, whose own voxels would hide it.
const END_CELLS: f32 = 2.0;
const END_WIDTHS: f32 = 1.5;
/// tan of half the aperture at least: of lights without extent.
const MIN_SPREAD: f32 = 0.01;

/// Share of what a light sends that arrives, in [0, 1]. `position_error` is not needed: cones begin farther off.
fn light_visibility(
    light: LightSample,
    position: vec3<f32>,
    position_error: vec3<f32>,
    normal: vec3<f32>,
    solid_angle: f32,
) -> f32 {
    let cell = finest_cell(position);
    let spread = max(spread_of_solid_angle(solid_angle), MIN_SPREAD);
    let offset = SHADOW_STEPPING.start_cells * cell * cells_across(normal);
    let end = END_CELLS * max(cell, finest_cell(light.place));
    let reach = max(light.distance - end, 0.0) / (1.0 + END_WIDTHS * 2.0 * spread);
    let cone = Cone(position, spread, light.direction, reach, normal, offset);
    return trace_cone(cone, SHADOW_STEPPING, 0.0).transmittance;
}
