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

/// How cones towards lights are marched: in fine steps, because a shadow's edge is visible.
const SHADOW_STEPPING: ConeSettings = ConeSettings(0.5, -0.4, 0.95, 1.5);
/// Cones end this many cells, and this many of their widths, before the light, because its own voxels would hide it.
const END_CELLS: f32 = 2.0;
const END_WIDTHS: f32 = 1.5;
/// Lower bound of tan of half the aperture, for lights without extent.
const MIN_SPREAD: f32 = 0.01;

/// Share of a light's radiation that arrives, in [0, 1]. `position_error` is not needed, because cones start farther
/// away.
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
