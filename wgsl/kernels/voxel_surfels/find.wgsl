// SPDX-License-Identifier: MIT OR Apache-2.0
//! Finds the surfel of each record of a level, once its side is known (voxel_light/sides).
//!
//! Dispatch: indirect, one invocation a record (slot · 6 + face, then second records), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns a surfel.

#import lucerna::components::voxel_light::cache::FaceFaults
#import lucerna::components::voxel_light::sides::NO_PLACE
#import lucerna::components::voxel_surfels::surfel::pack_surfel
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::fields::voxel_structure::{first_record_of_face, packed_cell_of_slot, side_of_record}
#import lucerna::integrators::face_surfel::find_surfel
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 64u;

struct FindInfo {
    /// Index of the level.
    level: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: FindInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read_write> found: array<vec4<u32>>;
@group(1) @binding(4) var<storage, read_write> faults: FaceFaults;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    if record >= counts.z {
        return;
    }
    let side = side_of_record(level, record);
    var words = vec4<u32>(0u);
    if side.place != NO_PLACE {
        let first = first_record_of_face(level, counts.x, record);
        let packed_cell = packed_cell_of_slot(level, first / level.grid.n_faces);
        let face = first % level.grid.n_faces;
        words = pack_surfel(find_surfel(level.grid, packed_cell, face, side.place, side.border));
    }
    found[level.first_record + record] = words;
    // (No index of a level has the top bit.)
    if !loops_run(info.level >> 31u) {
        atomicAdd(&faults.n_cut, 1u);
    }
}
