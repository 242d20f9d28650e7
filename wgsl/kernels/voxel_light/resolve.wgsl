// SPDX-License-Identifier: MIT OR Apache-2.0
//! Turns what `voxel_light/inject` has accumulated into means, and empties the accumulators.
//!
//! Means of several injections (one per light) are added: the irradiance of a surface is the sum over the lights, and
//! each light's mean is over its own samples. A record without samples adds 0.
//!
//! Dispatch: ceil(capacity · n_faces / 64) workgroups, over x first and y beyond 65 535; invocations for slots that do
//! not exist return at once. Workgroup memory: none. Each invocation owns one record.

#import lucerna::components::voxel_light::accumulator::{STRATEGY_EXACT, HEAD_WORDS, EXACT_WORDS, EXACT_COUNT, EXACT_HIGH}
#import lucerna::components::voxel_light::average::{WideSum, mean_of_sum, unpack_average, unpack_count}
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::fields::voxel_structure::n_slots

const WORKGROUP: u32 = 64u;
/// Chosen when the pipeline is created, as in `voxel_light/inject`.
override STRATEGY: u32 = 3u;

struct Resolution {
    /// Value of one integer step [W·m⁻²].
    quantum: f32,
    /// The value that packed words store as 1 [W·m⁻²].
    largest: f32,
    /// 1: the former means are replaced; 0: they are added to.
    first: u32,
    reserved: u32,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> resolution: Resolution;
@group(1) @binding(2) var<storage, read_write> accumulators: array<u32>;
/// rgb: irradiance [W·m⁻²]; a: number of samples (for the packed strategies, as far as they count).
@group(1) @binding(3) var<storage, read_write> means: array<vec4<f32>>;

/// A record's mean and count; its memory is zero afterwards.
fn take_exact(record: u32) -> vec4<f32> {
    let at = HEAD_WORDS + record * EXACT_WORDS;
    let count = accumulators[at + EXACT_COUNT];
    if count == 0u {
        return vec4<f32>(0.0);
    }
    let low = vec3<u32>(accumulators[at], accumulators[at + 1u], accumulators[at + 2u]);
    let high = vec3<u32>(
        accumulators[at + EXACT_HIGH],
        accumulators[at + EXACT_HIGH + 1u],
        accumulators[at + EXACT_HIGH + 2u],
    );
    // Most sums stay below 2³², so their high words are zero already and need not be written.
    for (var channel = 0u; channel < 3u; channel++) {
        accumulators[at + channel] = 0u;
        if high[channel] != 0u {
            accumulators[at + EXACT_HIGH + channel] = 0u;
        }
    }
    accumulators[at + EXACT_COUNT] = 0u;
    return vec4<f32>(mean_of_sum(WideSum(low, high), count, resolution.quantum), f32(count));
}

fn take_packed(record: u32) -> vec4<f32> {
    let word = accumulators[HEAD_WORDS + record];
    if word == 0u {
        return vec4<f32>(0.0);
    }
    accumulators[HEAD_WORDS + record] = 0u;
    return vec4<f32>(unpack_average(word) * resolution.largest, f32(unpack_count(word)));
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) n: vec3<u32>) {
    let record = id.y * n.x * WORKGROUP + id.x;
    if record >= min(n_slots(grid), grid.capacity) * grid.n_faces {
        return;
    }
    var mean: vec4<f32>;
    if STRATEGY == STRATEGY_EXACT {
        mean = take_exact(record);
    } else {
        mean = take_packed(record);
    }
    if resolution.first != 0u {
        means[record] = mean;
    } else if mean.w > 0.0 {
        means[record] += mean;
    }
}
