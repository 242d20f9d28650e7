// SPDX-License-Identifier: MIT OR Apache-2.0
//! From areas to masks: what the probe at each corner sees of each cell.
//!
//! Dispatch: one invocation a voxel of the range, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::probes::masks::{MASK_BITS, MASK_SUMS, MASK_WORDS, MaskRange, is_open, mask_with, seen_mask}
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> range: MaskRange;
/// x: occupied voxels.
@group(1) @binding(2) var<storage, read> counts: vec4<u32>;
/// See `probes/facing`.
@group(1) @binding(3) var<storage, read> areas: array<u32>;
/// After two words for each brick, MASK_WORDS for each voxel.
@group(1) @binding(4) var<storage, read_write> masks: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group) * WORKGROUP + local;
    let slot = range.first + ix;
    if ix >= range.n || slot >= counts.x {
        return;
    }
    let first = 2u * grid.bricks.x * grid.bricks.y * grid.bricks.z + MASK_WORDS * slot;
    for (var corner = 0u; corner < 8u; corner++) {
        var open = vec2<u32>(0u);
        for (var bit = 0u; bit < MASK_BITS; bit++) {
            let sums = (ix * MASK_BITS + bit) * MASK_SUMS;
            if is_open(areas[sums], areas[sums + 1u + corner]) {
                open = mask_with(open, bit);
            }
        }
        let seen = seen_mask(open, corner);
        masks[first + 2u * corner] = seen.x;
        masks[first + 2u * corner + 1u] = seen.y;
    }
}
