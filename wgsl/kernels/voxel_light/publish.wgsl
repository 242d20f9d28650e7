// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes from the faces' records what bounces and pictures look up, and counts those whose samples were left out.
//!
//! A face shares its light with the same faces of neighbouring cells, as far as they are on the same side (`lucerna::components::voxel_light::sides`). A voxel with
//! one value shares with all voxels around it.
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record of
//! `reflected` and of `shown`.

#import lucerna::fields::voxel_structure::{first_record_of_face, packed_cell_of_slot, record_for_point, side_of_record, slot_of_cell}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::{face_axis, unpack_cell}
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceFaults, FaceLight, SETTLED_PERIOD, coverage, current_hits, has_cut, has_rejected}
#import lucerna::components::voxel_light::neighbours::{n_neighbours, neighbour_offset, sharing_of_hits, tent}
#import lucerna::components::voxel_light::sides::{FaceSide, is_reached, unpack_place}

const WORKGROUP: u32 = 64u;
/// Stands for no coverage where its sign says that there is a second record.
const LEAST_COVERAGE: f32 = 1e-30;

struct PublishInfo {
    /// Index of the level.
    level: u32,
    /// 1: bounces see what was reflected before. 0: only direct light.
    feedback: u32,
    /// See `cache::current_hits`.
    light_rays: f32,
    /// Once the light has settled, nothing is published in frames that are no multiple of SETTLED_PERIOD. 0: always.
    frame: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: PublishInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read> lights: array<FaceLight>;
/// For bounces. rgb: direct light and what was reflected in the newest frame [W·m⁻²]; a: coverage, below 0 if the face has a
/// second record (`lucerna::components::voxel_light::sides`).
@group(1) @binding(4) var<storage, read_write> reflected: array<vec4<f32>>;
/// For pictures. rgb: light that was reflected at least once [W·m⁻²]; a: coverage.
@group(1) @binding(5) var<storage, read_write> shown: array<vec4<f32>>;
@group(1) @binding(6) var<storage, read_write> faults: FaceFaults;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    if record >= counts.z || (levels.is_settled != 0u && info.frame % SETTLED_PERIOD != 0u) {
        return;
    }
    let own = lights[level.first_record + record];
    if has_rejected(own) {
        atomicAdd(&faults.n_rejected, 1u);
    }
    if has_cut(own) {
        atomicAdd(&faults.n_cut, 1u);
    }
    let covered = coverage(own);
    let at = level.first_record + record;
    let is_isotropic = n_faces == 1u;
    let first = first_record_of_face(level, counts.x, record);
    var side: FaceSide;
    var is_divided = false;
    if !is_isotropic {
        side = side_of_record(level, record);
        is_divided = record == first && side.other != 0u;
    }
    if covered == 0.0 {
        let nothing = vec4<f32>(0.0, 0.0, 0.0, select(0.0, -LEAST_COVERAGE, is_divided));
        reflected[at] = nothing;
        shown[at] = nothing;
        return;
    }
    let own_slot = first / n_faces;
    let face = first % n_faces;
    let axis = face_axis(face);
    let cell = vec3<i32>(unpack_cell(packed_cell_of_slot(level, own_slot)));
    let share = sharing_of_hits(current_hits(own, info.light_rays));
    // rgb: sum, a: weight; the face's own record first.
    var feedback = covered * vec4<f32>(own.feedback, 1.0);
    var indirect = covered * vec4<f32>(own.indirect, 1.0);
    for (var ix = 0u; ix < n_neighbours(is_isotropic); ix++) {
        let offset = neighbour_offset(ix, axis, is_isotropic);
        if all(offset == vec3<i32>(0)) {
            continue;
        }
        if !is_isotropic && !is_reached(side.reach, offset) {
            continue;
        }
        let slot = slot_of_cell(level, cell + offset);
        if slot == NO_SLOT {
            continue;
        }
        var there = slot * n_faces + face;
        if !is_isotropic {
            there = record_for_point(level, there, unpack_place(side.place) - vec3<f32>(offset));
        }
        let light = lights[level.first_record + there];
        let weight = tent(offset) * coverage(light);
        feedback += weight * vec4<f32>(light.feedback, 1.0);
        indirect += share * weight * vec4<f32>(light.indirect, 1.0);
    }
    let again = select(vec3<f32>(0.0), feedback.rgb / feedback.a, info.feedback != 0u);
    // (Below 0: the face has a second record.)
    let signed = select(covered, -covered, is_divided);
    reflected[at] = vec4<f32>(own.direct + again, signed);
    shown[at] = vec4<f32>(indirect.rgb / indirect.a, signed);
}
