// SPDX-License-Identifier: MIT OR Apache-2.0
//! Copies the cache into a new structure, after something or the grid has moved.
//!
//! A record of a face that was there before keeps what the face's record on its side held (except for rejections, which
//! have been counted); a new one starts empty.
//!
//! Dispatch: indirect, one invocation a record of the new structure, in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns its record.

#import lucerna::fields::voxel_structure::{first_record_of_face, packed_cell_of_slot, side_of_record}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{is_inside, unpack_cell}
#import lucerna::components::voxels::levels::{VoxelLevels, side_word}
#import lucerna::components::voxel_light::cache::{FaceLight, without_rejection}
#import lucerna::components::voxel_light::sides::{is_before_border, unpack_place}

const WORKGROUP: u32 = 64u;

struct CarryInfo {
    /// Offset of the new grid's corner from the old one's [cells].
    shift: vec3<i32>,
    /// Index of the level.
    level: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: CarryInfo;
/// x: occupied voxels of the new structure; z: its records.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read> structure_before: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read> lights_before: array<FaceLight>;
@group(1) @binding(5) var<storage, read_write> lights: array<FaceLight>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    if record >= counts.z {
        return;
    }
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    let first = first_record_of_face(level, counts.x, record);
    let cell = vec3<i32>(unpack_cell(packed_cell_of_slot(level, first / n_faces))) + info.shift;
    var slot_before = NO_SLOT;
    if is_inside(level.grid, cell) {
        let brick = level.first_brick + brick_of_cell(level.grid, vec3<u32>(cell));
        slot_before = slot_in_brick(structure_before[brick], vec3<u32>(cell));
    }
    var light: FaceLight;
    if slot_before != NO_SLOT {
        var before = slot_before * n_faces + first % n_faces;
        if n_faces == 6u {
            let border = structure_before[side_word(level, before) + 1u];
            let place = unpack_place(side_of_record(level, record).place);
            if border.y != 0u && !is_before_border(border.x, place) {
                before = border.y - 1u;
            }
        }
        light = without_rejection(lights_before[level.first_record + before]);
    }
    lights[level.first_record + record] = light;
}
