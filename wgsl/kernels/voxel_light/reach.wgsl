// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds for each record which records around it are on the same side of the surfaces there
//! (`lucerna::components::voxel_light::sides`): those whose places are visible from its own.
//!
//! Dispatch: indirect, one invocation a record, in rows as `lucerna::math::dispatch` lays them out, after
//! `voxel_light/sides`. Workgroup memory: none. Each invocation writes a word of its own record, and reads words of others
//! that nothing writes.

#import lucerna::components::voxel_light::cache::FaceFaults
#import lucerna::components::voxel_light::sides::{NO_PLACE, is_before_border, reach_offset, unpack_place}
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{is_inside, unpack_cell}
#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels, side_word, slot_word}
#import lucerna::integrators::face_sides::see_each_other
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 64u;

struct ReachInfo {
    /// Index of the level.
    level: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: ReachInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read_write> structure: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read_write> faults: FaceFaults;

/// The slot of a cell, or NO_SLOT.
fn slot_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    if !is_inside(level.grid, cell) {
        return NO_SLOT;
    }
    let brick = structure[level.first_brick + brick_of_cell(level.grid, vec3<u32>(cell))];
    return slot_in_brick(brick, vec3<u32>(cell));
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    if record >= counts.z {
        return;
    }
    let at = side_word(level, record);
    let own = structure[at].y;
    if own == NO_PLACE {
        return;
    }
    var first = record;
    if record >= counts.x * n_faces {
        first = structure[at + 1u].y;
    }
    let cell = vec3<i32>(unpack_cell(structure[slot_word(level, first / n_faces)].x));
    let here = unpack_place(own);
    var reach = 0u;
    for (var bit = 0u; bit < 27u; bit++) {
        let offset = reach_offset(bit);
        if all(offset == vec3<i32>(0)) {
            reach |= 1u << bit;
            continue;
        }
        let slot = slot_of_cell(level, cell + offset);
        if slot == NO_SLOT {
            continue;
        }
        var there = side_word(level, slot * n_faces + first % n_faces);
        let border = structure[there + 1u];
        if border.y != 0u && !is_before_border(border.x, here - vec3<f32>(offset)) {
            there = side_word(level, border.y - 1u);
        }
        let place = structure[there].y;
        if place == NO_PLACE {
            continue;
        }
        let other = unpack_place(place) + vec3<f32>(offset);
        if see_each_other(level.grid, vec3<f32>(cell) + here, vec3<f32>(cell) + other) {
            reach |= 1u << bit;
        }
    }
    structure[at].x = reach;
    // (No index of a level has the top bit.)
    if !loops_run(info.level >> 31u) {
        atomicAdd(&faults.n_cut, 1u);
    }
}
