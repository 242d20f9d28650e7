// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: cones through the voxels.
//!
//! Interface: `ConeResult`, `trace_cone`, `start_height`. No bindings of its own: it reads `fields::voxel_pyramid` and
//! `fields::pyramid_layout`, and a renderer that keeps its voxels otherwise replaces these. The variant `cones=surfels` follows
//! a cone's axis from surface to surface instead.
#define_import_path lucerna::fields::cone_trace

#import lucerna::cone::march::{Cone, ConeCells, ConeSettings, HALF_OF_WALL, MAX_STEPS, cells_across, cone_cells, cone_point, cone_step}
#import lucerna::cone::medium::{Medium, MediumLight, add_medium, clear_way, end_of_way}
#import lucerna::components::voxel_pyramid::layout::{MAX_MIPS, direction_weights, pyramid_weight, radiance_scale}
#import lucerna::fields::pyramid_layout::{finest_cell, pyramid}
#import lucerna::fields::voxel_pyramid::filtered_texel
#import lucerna::components::voxels::grid::faces_of_direction

/// The result of a cone.
struct ConeResult {
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
    /// Share of the cone that hit nothing, in [0, 1].
    transmittance: f32,
    /// The same, within the distance `near`.
    near_transmittance: f32,
    n_steps: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// How far along the normal a cone starts, to be clear of the surface's own voxels [m]. `normal`: unit length.
fn start_height(position: vec3<f32>, normal: vec3<f32>, settings: ConeSettings) -> f32 {
    return settings.start_cells * finest_cell(position) * cells_across(normal);
}

/// A mip of a level as a medium, seen along a direction.
fn medium_of_mip(level_ix: u32, mip: u32, position: vec3<f32>, direction: vec3<f32>) -> Medium {
    let level = pyramid.levels[level_ix];
    let cell = level.cell * f32(1u << mip);
    let point = (position - level.origin) / cell;
    let entry = level_ix * MAX_MIPS + mip;
    var texel: vec4<f32>;
    if pyramid.n_faces == 1u {
        texel = filtered_texel(entry, mip, 0u, point);
    } else {
        // A viewer who looks along +X sees the −X faces.
        let faces = faces_of_direction(-direction);
        let weights = direction_weights(pyramid.squared_weights, direction);
        for (var axis = 0u; axis < 3u; axis++) {
            texel += weights[axis] * filtered_texel(entry, mip, faces[axis], point);
        }
    }
    return Medium(texel.rgb / cell, texel.a / cell);
}

/// The voxels around a point (their light times `components::voxel_pyramid::layout::radiance_scale`), averaged over
/// cells (interpolated between the two nearest mips that are not too large), seen along a direction of unit length.
fn medium_at(position: vec3<f32>, direction: vec3<f32>, cells: ConeCells) -> Medium {
    var out = Medium(vec3<f32>(0.0), 0.0);
    var rest = 1.0;
    for (var ix = 0u; ix < pyramid.n_levels && rest > 0.0; ix++) {
        let level = pyramid.levels[ix];
        // (A little more, because of rounding: a cell of exactly the largest size is not too large.)
        let largest = floor(log2(cells.largest / level.cell) + 1e-4);
        let mip = clamp(min(log2(cells.matching / level.cell), largest), 0.0, f32(level.n_mips - 1u));
        let is_last = ix + 1u == pyramid.n_levels;
        // If the next level has cells that are fine enough, it is used, because its data are more compact.
        if !is_last && cells.matching >= 2.0 * pyramid.levels[ix + 1u].cell {
            continue;
        }
        let inside = pyramid_weight(level, ceil(mip), (position - level.origin) / level.cell);
        let share = rest * select(inside, 1.0, is_last);
        if share <= 0.0 {
            continue;
        }
        rest -= share;
        let lower = floor(mip);
        let upper_share = mip - lower;
        for (var upper = 0u; upper < 2u; upper++) {
            let of_mip = share * select(1.0 - upper_share, upper_share, upper == 1u);
            if of_mip > 0.0 {
                let medium = medium_of_mip(ix, u32(lower) + upper, position, direction);
                out.emission += of_mip * medium.emission;
                out.extinction += of_mip * medium.extinction;
            }
        }
    }
    return out;
}

/// Follows a cone to its end. `near`: distance up to which `near_transmittance` counts [m]; an opaque wall exactly
/// there counts half.
///
/// Steps are as long as the cone is wide, times the step scale; the value in the middle of a step is used for all of
/// it. A cone whose opacity exceeds the threshold ends (`medium::end_of_way`).
fn trace_cone(cone: Cone, settings: ConeSettings, near: f32) -> ConeResult {
    var light = clear_way();
    var near_light = 1.0;
    var t = 0.0;
    var n_steps = 0u;
    // There is nothing outside the last level.
    let last = pyramid.levels[pyramid.n_levels - 1u];
    let low = last.origin;
    let high = last.origin + vec3<f32>(last.size) * last.cell;
    while n_steps < MAX_STEPS && t < cone.max_distance {
        let at = cone_point(cone, t);
        let cells = cone_cells(cone, settings, t, finest_cell(at));
        // (Filtering spreads the outermost cells by half of one.)
        let above = at > high + 0.5 * cells.matching;
        let below = at < low - 0.5 * cells.matching;
        if any((above & (cone.direction > vec3<f32>(0.0))) | (below & (cone.direction < vec3<f32>(0.0)))) {
            break;
        }
        let length = min(cone_step(cone, settings, t, cells.matching), cone.max_distance - t);
        let medium = medium_at(cone_point(cone, t + 0.5 * length), cone.direction, cells);
        let near_part = clamp(near - HALF_OF_WALL * cells.matching - t, 0.0, length);
        near_light *= exp(-medium.extinction * near_part);
        light = add_medium(light, medium, length);
        t += length;
        n_steps++;
        if 1.0 - light.transmittance >= settings.opacity_threshold {
            light = end_of_way(light, settings.opacity_threshold);
            near_light = select(near_light, 0.0, near - HALF_OF_WALL * cells.matching > t);
            break;
        }
    }
    return ConeResult(light.radiance / radiance_scale(pyramid.peak), light.transmittance, near_light, n_steps, 0u, 0u);
}
