// SPDX-License-Identifier: MIT OR Apache-2.0
//! The largest irradiance of a level's faces, by which the pyramid's 16-bit floats are scaled
//! (`components::voxel_pyramid::layout::radiance_scale`).
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as `lucerna::math::dispatch` lays them
//! out. Workgroup memory: 4 bytes. The maximum of integers does not depend on the order.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::math::vector::max_component
#import lucerna::components::voxels::levels::VoxelLevels

const WORKGROUP: u32 = 64u;

struct PeakInfo {
    /// Index of the level.
    level: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: PeakInfo;
/// x: occupied voxels of the level.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
/// rgb: irradiance [W·m⁻²].
@group(1) @binding(3) var<storage, read> irradiance: array<vec4<f32>>;
/// Bits of a float ≥ 0; the host clears it.
@group(1) @binding(4) var<storage, read_write> peak: atomic<u32>;

var<workgroup> peak_of_group: atomic<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    if record < counts.x * level.grid.n_faces {
        let found = irradiance[level.first_record + record].rgb;
        if all_finite(found) {
            // Non-negative floats have the order of their bits.
            atomicMax(&peak_of_group, bitcast<u32>(max(max_component(found), 0.0)));
        }
    }
    workgroupBarrier();
    if local == 0u {
        atomicMax(&peak, atomicLoad(&peak_of_group));
    }
}
