// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums light over blocks of values, so that `convergence/compare` can tell by how much it has changed.
//!
//! The sum of a block has little noise, while light that is still missing in one part of a scene shows in that part's blocks. Each
//! block has two sums, of every other run of its values: what has changed in both is light, and what has changed in one is noise.
//!
//! Dispatch: `math/dispatch` of one workgroup a block. Workgroup memory: 512 bytes. A workgroup owns one pair of sums, and adds in a
//! fixed order: the same input gives the same bytes.

#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite

const WORKGROUP: u32 = 64u;
/// Values per block.
const BLOCK: u32 = 8192u;
/// Values per run: enough that few have neighbours in another run, with which they share noise.
const RUN: u32 = 128u;
const_assert BLOCK % (2u * RUN) == 0u && RUN % WORKGROUP == 0u;

struct SumInfo {
    /// Index of the first value.
    first: u32,
    /// Values that there is room for: those that are counted by `counts`, at most.
    capacity: u32,
    /// Index of the first pair of sums.
    first_sum: u32,
    reserved: u32,
}

@group(1) @binding(0) var<uniform> info: SumInfo;
/// z: number of values.
@group(1) @binding(1) var<uniform> counts: vec4<u32>;
/// rgb: light, at least 0 in any unit; a: weight, whose sign does not matter.
@group(1) @binding(2) var<storage, read> light: array<vec4<f32>>;
/// For each block the sums of weighted r + g + b over its even and its odd runs. A value that is not finite counts as 0.
@group(1) @binding(3) var<storage, read_write> sums: array<vec2<f32>>;

var<workgroup> partial: array<vec2<f32>, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let block = group_of_dispatch(workgroup_id);
    let n_values = min(counts.z, info.capacity);
    // Groups past the end have no block; their index may wrap, and they load and store nothing.
    let is_block = block < (info.capacity + BLOCK - 1u) / BLOCK;
    var sum = vec2<f32>(0.0);
    if is_block {
        let end = min((block + 1u) * BLOCK, n_values);
        for (var ix = block * BLOCK + local; ix < end; ix += WORKGROUP) {
            let value = light[info.first + ix];
            if all_finite(value.rgb) {
                sum[ix / RUN % 2u] += abs(value.a) * (value.r + value.g + value.b);
            }
        }
    }
    partial[local] = sum;
    workgroupBarrier();
    for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
        if local < reach {
            partial[local] += partial[local + reach];
        }
        workgroupBarrier();
    }
    if local == 0u && is_block {
        sums[info.first_sum + block] = partial[0];
    }
}
