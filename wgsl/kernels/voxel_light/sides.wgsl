// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds for each face's record a place (`lucerna::components::voxel_light::sides`), and adds second records.
//!
//! * `find_places`: what the face sees, in groups that see each other. The largest group that is not enclosed gives the record
//!   its place; if there is another, the face gets a second record.
//! * `count_records`, after it: the dispatch for all records.
//!
//! Dispatch: `find_places`: indirect, one invocation a first record (slot · 6 + face), in rows as
//! `lucerna::math::dispatch` lays them out; `count_records`: 1 × 1 × 1. Workgroup memory: none. Each invocation writes its own
//! record's words and those of the second record that it adds; the order of second records is that of the work, and nothing
//! else depends on it.

#import lucerna::components::voxel_light::cache::FaceFaults
#import lucerna::components::voxel_light::sides::{NO_BORDER, NO_PLACE}
#import lucerna::components::voxels::counts::COUNTED_WORKGROUP
#import lucerna::components::voxels::grid::unpack_cell
#import lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels, side_word, slot_word}
#import lucerna::integrators::face_sides::{border_between, choose_groups, groups_of, look_into, place_of_group}
#import lucerna::math::dispatch::{dispatch_of_groups, group_of_dispatch}
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 64u;
struct SidesInfo {
    /// Index of the level.
    level: u32,
    /// 1: faces get second records where a wall stands across what they see.
    divides: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: SidesInfo;
@group(1) @binding(2) var<storage, read_write> structure: array<vec2<u32>>;
@group(1) @binding(3) var<storage, read_write> tally: RecordCounts;
@group(1) @binding(4) var<storage, read_write> faults: FaceFaults;

/// `lucerna::components::voxels::counts::VoxelCounts`, while records are added.
struct RecordCounts {
    n_voxels: u32,
    n_overflow: u32,
    n_records: atomic<u32>,
    /// Faces that should have a second record, for which there was no room.
    n_undivided: atomic<u32>,
    voxel_groups: vec3<u32>,
    reserved_b: u32,
    record_groups: vec3<u32>,
    reserved_c: u32,
}

@compute @workgroup_size(WORKGROUP)
fn find_places(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let grid = level.grid;
    if record >= tally.n_voxels * grid.n_faces {
        return;
    }
    let packed_cell = structure[slot_word(level, record / grid.n_faces)].x;
    let cell = vec3<f32>(unpack_cell(packed_cell));
    var seen = look_into(grid, packed_cell, record % grid.n_faces);
    var place = NO_PLACE;
    var border = NO_BORDER;
    var other = 0u;
    if seen.n > 0u {
        let groups = groups_of(grid, cell, &seen);
        let chosen = choose_groups(grid, cell, &seen, groups);
        place = place_of_group(&seen, groups, chosen.own);
        if chosen.beyond != 0u && info.divides != 0u {
            let there = place_of_group(&seen, groups, chosen.beyond);
            border = border_between(grid, cell, place, there);
            if chosen.second != 0u && border != NO_BORDER {
                other = add_record(level, record, there, border_between(grid, cell, there, place));
            }
        }
    }
    let at = side_word(level, record);
    structure[at] = vec2<u32>(0u, place);
    structure[at + 1u] = vec2<u32>(border, other);
    // (No index of a level has the top bit.)
    if !loops_run(info.level >> 31u) {
        atomicAdd(&faults.n_cut, 1u);
    }
}

/// Adds the second record of a face; returns 1 + its index, or 0 if there is no room.
fn add_record(level: VoxelLevel, first: u32, place: u32, border: u32) -> u32 {
    let ix = atomicAdd(&tally.n_records, 1u);
    if ix >= level.grid.capacity * level.grid.n_faces {
        atomicSub(&tally.n_records, 1u);
        atomicAdd(&tally.n_undivided, 1u);
        return 0u;
    }
    let at = side_word(level, ix);
    structure[at] = vec2<u32>(0u, place);
    structure[at + 1u] = vec2<u32>(border, first);
    return ix + 1u;
}

@compute @workgroup_size(1)
fn count_records() {
    let n = atomicLoad(&tally.n_records);
    tally.record_groups = dispatch_of_groups((n + COUNTED_WORKGROUP - 1u) / COUNTED_WORKGROUP);
}
