// SPDX-License-Identifier: MIT OR Apache-2.0
//! Makes what rays from lights or the camera deposited (voxel_light/inject, voxel_light/resolve) the direct light of
//! the faces.
//!
//! Dispatch: indirect, one invocation a record, in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record.

#import lucerna::fields::voxel_structure::first_record_of_face
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceLight, add_deposit}

const WORKGROUP: u32 = 64u;

struct DepositInfo {
    /// Index of the level.
    level: u32,
    /// See `cache::add_deposit`.
    light_frames: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: DepositInfo;
/// x: occupied voxels of the level; z: its records.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
/// Only this level's. rgb: irradiance [W·m⁻²]; a: number of samples.
@group(1) @binding(3) var<storage, read> means: array<vec4<f32>>;
@group(1) @binding(4) var<storage, read_write> lights: array<FaceLight>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    if record >= counts.z {
        return;
    }
    let at = level.first_record + record;
    // (Both records of a face get what was deposited there.)
    let first = first_record_of_face(level, counts.x, record);
    lights[at] = add_deposit(lights[at], means[first], info.light_frames);
}
