// SPDX-License-Identifier: MIT OR Apache-2.0
//! Exclusive prefix sums within blocks of 4096 numbers, in place, and the sum of each block.
//!
//! One level of a scan: the same kernel scans the blocks' sums, and `scan/add` adds them back to
//! the numbers. W. Hillis, G. Steele, "Data Parallel Algorithms", CACM 29(12), 1986. Sums saturate
//! at 2³² − 1.
//!
//! Dispatch: `math/dispatch` of ceil(n/4096). Workgroup memory: 1024 bytes.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::saturating::add_saturating

const WORKGROUP: u32 = 256u;
/// Numbers per invocation.
const RUN: u32 = 16u;
/// Numbers per workgroup.
const BLOCK: u32 = 4096u;
const_assert BLOCK == WORKGROUP * RUN;

struct ScanInfo {
    /// Count of numbers.
    n: u32,
    /// ceil(n / BLOCK)
    n_blocks: u32,
}

@group(1) @binding(0) var<uniform> info: ScanInfo;
@group(1) @binding(1) var<storage, read_write> numbers: array<u32>;
/// One per block.
@group(1) @binding(2) var<storage, read_write> sums: array<u32>;

var<workgroup> partial: array<u32, 256>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let block = group_of_dispatch(workgroup_id);
    let first = block * BLOCK + local * RUN;
    // Groups past the end have no block; their index may wrap, and they load nothing.
    var end = 0u;
    if block < info.n_blocks {
        end = min(first + RUN, info.n);
    }
    var sum = 0u;
    for (var k = first; k < end; k++) {
        sum = add_saturating(sum, numbers[k]);
    }
    partial[local] = sum;
    workgroupBarrier();
    for (var reach = 1u; reach < WORKGROUP; reach *= 2u) {
        var before = 0u;
        if local >= reach {
            before = partial[local - reach];
        }
        workgroupBarrier();
        partial[local] = add_saturating(partial[local], before);
        workgroupBarrier();
    }
    var total = 0u;
    if local > 0u {
        total = partial[local - 1u];
    }
    for (var k = first; k < end; k++) {
        let number = numbers[k];
        numbers[k] = total;
        total = add_saturating(total, number);
    }
    if local == WORKGROUP - 1u && block < info.n_blocks {
        sums[block] = total;
    }
}
