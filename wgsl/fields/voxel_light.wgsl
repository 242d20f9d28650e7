// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: light that voxels hold, looked up at surface points.
//!
//! Interface: `irradiance_at`, `cell_at`, the LOOKUP_ constants. No bindings of its own: only
//! `fields::voxel_light_texels` knows where the light is stored, and a renderer that stores it differently replaces
//! that module.
#define_import_path lucerna::fields::voxel_light

#import lucerna::components::voxels::grid::{faces_of_direction, grid_from_world}
#import lucerna::components::voxels::levels::{VoxelLevel, level_weight}
#import lucerna::components::voxels::lookup::{LightSum, add_share, add_weighted, face_weights, tap_cell, tap_weight, taps_at}
#import lucerna::components::voxel_light::sides::{REACHES_ALL, SIDE_OFFSET, is_reached}
#import lucerna::fields::voxel_light_texels::{NO_VOXEL, levels, light_of_face, reach_of_face, voxel_of_cell}

/// Trilinear over the cells with surfaces that face the same way as the point's.
const LOOKUP_VALID: u32 = 0u;
/// Trilinear over all eight cells, where empty ones count as dark.
const LOOKUP_TRILINEAR: u32 = 1u;
/// The mean of seven such look-ups, one cell apart along each axis.
const LOOKUP_SEVEN_TAP: u32 = 2u;
/// How far a look-up's point is moved along its normal [cells], so that no cell behind the surface is among the taps.
const NORMAL_OFFSET: f32 = 0.5;

/// Which records around a point's own cell are on the point's side, for each axis's face; everything if nothing is known.
/// `point`: in grid units; `weights`: those of the axes' faces.
fn reach_of_point(level: VoxelLevel, point: vec3<f32>, faces: vec3<u32>, weights: vec3<f32>) -> vec3<u32> {
    let cell = floor(point);
    let voxel = voxel_of_cell(level, vec3<i32>(cell));
    var reach = vec3<u32>(0u);
    for (var axis = 0u; axis < 3u; axis++) {
        if weights[axis] > 0.0 {
            reach[axis] = reach_of_face(level, voxel, faces[axis], point - cell);
        }
    }
    // A face that has no record here reaches what the others do.
    let any_face = reach.x | reach.y | reach.z;
    let known = select(any_face, REACHES_ALL, any_face == 0u);
    return select(reach, vec3<u32>(known), reach == vec3<u32>(0u));
}

/// The light of a level around a point of its grid, on the side of the normal: a sum weighted by distance, by how much
/// each face faces that way, and by how much of it a surface covers. `only_valid` false: every cell counts, empty ones
/// as dark.
fn light_in_level(level: VoxelLevel, at: vec3<f32>, normal: vec3<f32>, only_valid: bool) -> LightSum {
    let weights = face_weights(level.grid.n_faces, normal);
    let faces = select(faces_of_direction(normal), vec3<u32>(0u), level.grid.n_faces == 1u);
    var taps = taps_at(at);
    var reach = vec3<u32>(REACHES_ALL);
    // A surface on a border between cells belongs to the cell in front of it.
    let own = at + normal * SIDE_OFFSET;
    let own_cell = vec3<i32>(floor(own));
    if only_valid {
        taps = taps_at(at + normal * NORMAL_OFFSET);
        reach = reach_of_point(level, own, faces, weights);
    }
    var sum: LightSum;
    for (var ix = 0u; ix < 8u; ix++) {
        let weight = tap_weight(taps, ix);
        sum.weight += select(weight, 0.0, only_valid);
        let cell = tap_cell(taps, ix);
        let voxel = voxel_of_cell(level, cell);
        if voxel == NO_VOXEL {
            continue;
        }
        let shares = weight * weights;
        for (var axis = 0u; axis < 3u; axis++) {
            if weights[axis] > 0.0 && (!only_valid || is_reached(reach[axis], cell - own_cell)) {
                let light = light_of_face(level, voxel, faces[axis], own - vec3<f32>(cell));
                if only_valid {
                    sum = add_weighted(sum, light.rgb, shares[axis] * light.a);
                } else {
                    sum.irradiance += shares[axis] * light.rgb;
                }
            }
        }
    }
    return sum;
}

/// The stored irradiance at a surface point [W·m⁻²]; 0 if nothing is known.
///
/// `position` [m], `normal`: unit length, on the side of the surface that is looked up; `lookup`: a LOOKUP_ constant.
fn irradiance_at(position: vec3<f32>, normal: vec3<f32>, lookup: u32) -> vec3<f32> {
    let only_valid = lookup != LOOKUP_TRILINEAR && lookup != LOOKUP_SEVEN_TAP;
    var out: LightSum;
    for (var ix = 0u; ix < levels.n_levels && out.weight < 1.0; ix++) {
        let level = levels.levels[ix];
        let point = grid_from_world(level.grid, position);
        let is_last = ix + 1u == levels.n_levels;
        let share = (1.0 - out.weight) * select(level_weight(level.grid, point), 1.0, is_last);
        if share <= 0.0 {
            continue;
        }
        // The centre, then a cell to either side along each axis.
        let n_lookups = select(1u, 7u, lookup == LOOKUP_SEVEN_TAP);
        var found: LightSum;
        for (var tap = 0u; tap < n_lookups; tap++) {
            var offset = vec3<f32>(0.0);
            if tap > 0u {
                offset[(tap - 1u) >> 1u] += select(-1.0, 1.0, (tap & 1u) != 0u);
            }
            let one = light_in_level(level, point + offset, normal, only_valid);
            found.irradiance += one.irradiance;
            found.weight += one.weight;
        }
        if found.weight > 0.0 {
            out = add_share(out, found, share);
        }
    }
    return out.irradiance;
}

/// The cell of a surface point, and its level in w: the finest that counts at the point.
///
/// `position` [m], `normal`: the surface's, unit length.
fn cell_at(position: vec3<f32>, normal: vec3<f32>) -> vec4<u32> {
    for (var ix = 0u; ix + 1u < levels.n_levels; ix++) {
        let point = grid_from_world(levels.levels[ix].grid, position);
        if level_weight(levels.levels[ix].grid, point) > 0.0 {
            return vec4<u32>(vec3<u32>(floor(point + normal * SIDE_OFFSET)), ix);
        }
    }
    let last = levels.n_levels - 1u;
    let point = grid_from_world(levels.levels[last].grid, position);
    return vec4<u32>(vec3<u32>(max(floor(point + normal * SIDE_OFFSET), vec3<f32>(0.0))), last);
}
