// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reflects light between voxels once more, for voxels with surfels: as `voxel_cone/bounce`, but cones start where the record's
//! surface is, and second records of divided faces gather as well.
//!
//! Dispatch: indirect, one invocation a record (slot · 6 + face, then second records), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record: the
//! same input gives the same bytes.

#import lucerna::components::voxel_light::cache::{FaceFaults, FaceLight}
#import lucerna::components::voxel_light::sides::{NO_PLACE, unpack_place}
#import lucerna::components::voxel_surfels::surfel::{surfel_is_seen, unpack_surfel}
#import lucerna::components::voxels::grid::{unpack_cell, world_from_grid}
#import lucerna::cone::march::ConeSettings
#import lucerna::fields::cone_gather::gather_cones
#import lucerna::fields::voxel_light_texels::levels
#import lucerna::fields::voxel_structure::{first_record_of_face, packed_cell_of_slot, side_of_record}
#import lucerna::fields::voxel_surfels::surfels
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::math::loops::loops_run
#import lucerna::sampling::pcg::pcg

const WORKGROUP: u32 = 64u;

struct BounceInfo {
    cones: ConeSettings,
    n_cones: u32,
    /// Index of the level.
    level: u32,
    frame: u32,
    /// Frames in which each face is updated once, at least 1: before and after the light has settled.
    period: u32,
    settled_period: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> info: BounceInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(1) var<uniform> counts: vec4<u32>;
@group(1) @binding(2) var<storage, read_write> lights: array<FaceLight>;
@group(1) @binding(3) var<storage, read_write> faults: FaceFaults;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    if record >= counts.z {
        return;
    }
    let first = first_record_of_face(level, counts.x, record);
    let packed_cell = packed_cell_of_slot(level, first / level.grid.n_faces);
    let hash = pcg(packed_cell ^ pcg(first % level.grid.n_faces + 8u * info.level));
    let period = select(info.period, info.settled_period, levels.is_settled != 0u);
    if (info.frame + hash) % period != 0u {
        return;
    }
    let at = level.first_record + record;
    let side = side_of_record(level, record);
    let words = surfels[at];
    // If no ray hit a surface, none is visible.
    if !surfel_is_seen(words) || side.place == NO_PLACE || !(lights[at].n_hits > 0.0) {
        return;
    }
    let normal = unpack_surfel(words).normal;
    let place = vec3<f32>(unpack_cell(packed_cell)) + unpack_place(side.place);
    let found = gather_cones(
        world_from_grid(level.grid, place),
        normal,
        normal,
        info.n_cones,
        hash ^ pcg(record - first),
        info.frame / period,
        info.cones,
        FLOAT_MAX,
        0.0,
    );
    // (No index of a level has the top bit.) A face whose cones were cut short is left unchanged.
    if !loops_run(info.level >> 31u) {
        atomicAdd(&faults.n_cut, 1u);
    } else if all_finite(found.irradiance) {
        lights[at].indirect = found.irradiance;
        lights[at].feedback = found.irradiance;
    }
}
