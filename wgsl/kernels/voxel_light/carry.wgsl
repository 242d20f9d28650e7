// SPDX-License-Identifier: MIT OR Apache-2.0
//! Copies the cache into a new structure, after something or the grid has moved.
//!
//! A voxel that was occupied before keeps its faces' records (except for rejections, which have been counted); a new
//! one starts empty.
//!
//! Dispatch: indirect, one invocation a slot of the new structure, in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns its voxel's records.

#import lucerna::fields::voxel_structure::packed_cell_of_slot
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{is_inside, unpack_cell}
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceLight, without_rejection}

const WORKGROUP: u32 = 64u;

struct CarryInfo {
    /// Offset of the new grid's corner from the old one's [cells].
    shift: vec3<i32>,
    /// Index of the level.
    level: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: CarryInfo;
/// x: occupied voxels of the new structure.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read> structure_before: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read> lights_before: array<FaceLight>;
@group(1) @binding(5) var<storage, read_write> lights: array<FaceLight>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = group_of_dispatch(group) * WORKGROUP + local;
    if slot >= counts.x {
        return;
    }
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    let cell = vec3<i32>(unpack_cell(packed_cell_of_slot(level, slot))) + info.shift;
    var slot_before = NO_SLOT;
    if is_inside(level.grid, cell) {
        let brick = level.first_brick + brick_of_cell(level.grid, vec3<u32>(cell));
        slot_before = slot_in_brick(structure_before[brick], vec3<u32>(cell));
    }
    for (var face = 0u; face < n_faces; face++) {
        var light: FaceLight;
        if slot_before != NO_SLOT {
            light = without_rejection(lights_before[level.first_record + slot_before * n_faces + face]);
        }
        lights[level.first_record + slot * n_faces + face] = light;
    }
}
