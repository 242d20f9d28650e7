// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds to each number of a block the sum of all blocks before it: the downward pass of a scan.
//!
//! Dispatch: `math/dispatch` of ceil(n/256). Workgroup memory: none.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::saturating::add_saturating

const WORKGROUP: u32 = 256u;
/// As in `scan/blocks`.
const BLOCK: u32 = 4096u;

struct ScanInfo {
    n: u32,
    n_blocks: u32,
}

@group(1) @binding(0) var<uniform> info: ScanInfo;
@group(1) @binding(1) var<storage, read_write> numbers: array<u32>;
/// Scanned.
@group(1) @binding(2) var<storage, read_write> sums: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let ix = group_of_dispatch(workgroup_id) * WORKGROUP + local;
    if ix >= info.n {
        return;
    }
    numbers[ix] = add_saturating(numbers[ix], sums[ix / BLOCK]);
}
