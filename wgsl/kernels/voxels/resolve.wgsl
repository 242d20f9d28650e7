// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes the records of a range of voxels from their sums, and resets the sums to 0.
//!
//! Dispatch: `math/dispatch` of ceil(range.n/64). Workgroup memory: none. An invocation owns a voxel
//! with all its faces.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::components::voxels::attributes::{N_SUMS, RECORD_BACK, SUM_WEIGHT, SlotRange, encode_face, face_of_sums, float_of_sum}
#import lucerna::components::voxels::counts::VoxelCounts
#import lucerna::components::voxels::grid::VoxelGrid

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> range: SlotRange;
@group(1) @binding(2) var<storage, read> counts: VoxelCounts;
/// As in `voxels/accumulate`.
@group(1) @binding(3) var<storage, read_write> sums: array<vec2<u32>>;
/// Indexed by slot·n_faces + face, see `components::voxels::attributes`.
@group(1) @binding(4) var<storage, read_write> records: array<vec4<u32>>;

fn load(record: u32) -> array<f32, N_SUMS> {
    var out = array<f32, N_SUMS>();
    for (var k = 0u; k < N_SUMS; k++) {
        out[k] = float_of_sum(sums[record * N_SUMS + k]);
    }
    return out;
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let ix = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    if ix >= range.n || range.first + ix >= counts.n_voxels {
        return;
    }
    for (var face = 0u; face < grid.n_faces; face++) {
        let record = ix * grid.n_faces + face;
        let front = load(record);
        // An isotropic voxel has no other side.
        let back = load(ix * grid.n_faces + select(face ^ 1u, 0u, grid.n_faces == 1u));
        var packed = vec4<u32>(0u);
        if front[SUM_WEIGHT] > 0.0 || back[SUM_WEIGHT] > 0.0 {
            packed = encode_face(face_of_sums(front, back, range.brightest));
            packed.x |= select(0u, RECORD_BACK, front[SUM_WEIGHT] == 0.0);
        }
        records[range.first * grid.n_faces + record] = packed;
    }
    let first = ix * grid.n_faces * N_SUMS;
    for (var k = first; k < first + grid.n_faces * N_SUMS; k++) {
        sums[k] = vec2<u32>(0u);
    }
}
