// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reflects light between voxels once more: cones from the voxels' faces gather the light of the pyramid.
//!
//! What a face gathers becomes its `feedback` (`components::voxel_light::cache`), which `voxel_light/publish` and
//! `voxel_pyramid/fill` write into the pyramid: each round adds a bounce. Each face is updated in one of `period`
//! frames.
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record: the
//! same input gives the same bytes.

#import lucerna::cone::march::ConeSettings
#import lucerna::fields::cone_gather::gather_cones
#import lucerna::fields::voxel_structure::packed_cell_of_slot
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::math::loops::loops_run
#import lucerna::sampling::pcg::pcg
#import lucerna::components::voxels::attributes::{decode_face, record_is_valid}
#import lucerna::components::voxels::grid::{face_normal, unpack_cell, world_from_grid}
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceFaults, FaceLight, hit_depth}

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

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: BounceInfo;
/// x: occupied voxels of the level.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
/// Only this level's, indexed by slot · n_faces + face: `components::voxels::attributes`.
@group(1) @binding(3) var<storage, read> records: array<vec4<u32>>;
@group(1) @binding(4) var<storage, read_write> lights: array<FaceLight>;
@group(1) @binding(5) var<storage, read_write> faults: FaceFaults;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    if record >= counts.x * n_faces {
        return;
    }
    let packed_cell = packed_cell_of_slot(level, record / n_faces);
    let face = record % n_faces;
    let hash = pcg(packed_cell ^ pcg(face + 8u * info.level));
    let period = select(info.period, info.settled_period, levels.is_settled != 0u);
    if (info.frame + hash) % period != 0u {
        return;
    }
    let packed = records[record];
    let known = lights[level.first_record + record];
    // If no ray hit a surface, none is visible.
    if !record_is_valid(packed) || !(known.n_hits > 0.0) {
        return;
    }
    let surface = decode_face(packed);
    var place = vec3<f32>(unpack_cell(packed_cell)) + 0.5;
    if n_faces == 6u {
        place += face_normal(face) * (0.5 - hit_depth(known));
    }
    let found = gather_cones(
        world_from_grid(level.grid, place),
        surface.normal,
        surface.normal,
        info.n_cones,
        hash,
        info.frame / period,
        info.cones,
        FLOAT_MAX,
        0.0,
    );
    // (No index of a level has the top bit.) A face whose cones were cut short is left unchanged.
    if !loops_run(info.level >> 31u) {
        atomicAdd(&faults.n_cut, 1u);
    } else if all_finite(found.irradiance) {
        lights[level.first_record + record].indirect = found.irradiance;
        lights[level.first_record + record].feedback = found.irradiance;
    }
}
