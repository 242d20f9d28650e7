// SPDX-License-Identifier: MIT OR Apache-2.0
//! Counts the records whose samples were left out.
//!
//! Dispatch: indirect, one invocation a record, in rows as `lucerna::math::dispatch` lays them out.
//! Workgroup memory: none.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::levels::VoxelLevels
#import lucerna::components::voxel_light::cache::{FaceFaults, FaceLight, has_cut, has_rejected}

const WORKGROUP: u32 = 64u;

struct FaultsInfo {
    /// Index of the level.
    level: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: FaultsInfo;
/// z: records of the level.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
@group(1) @binding(3) var<storage, read> lights: array<FaceLight>;
@group(1) @binding(4) var<storage, read_write> faults: FaceFaults;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    if record >= counts.z {
        return;
    }
    let light = lights[levels.levels[info.level].first_record + record];
    if has_rejected(light) {
        atomicAdd(&faults.n_rejected, 1u);
    }
    if has_cut(light) {
        atomicAdd(&faults.n_cut, 1u);
    }
}
