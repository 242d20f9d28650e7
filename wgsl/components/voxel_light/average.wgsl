// SPDX-License-Identifier: MIT OR Apache-2.0
//! Averages of many samples in one place of memory: exact in integers, and packed in one word.
//!
//! **Exact.** A sample's channel becomes an integer q = round(value/quantum) < 2³², and 64-bit sums of q are kept as
//! two words. Integer sums do not depend on the order of the samples, nor on how they are grouped, so the mean is the
//! same to the last bit. n samples sum to at most n·QUANTA_MAX ≤ (2³²−1)(2³²−256) < 2⁶⁴: as long as the count fits its
//! word, the sum cannot overflow. The error of each rounding, and so of their mean, is at most half a quantum: relative
//! to a mean m, at most quantum/(2m); 1e-4 from m = 5000 quanta on, 1.2e-6 of the largest value.
//!
//! **Packed.** C. Crassin, S. Green, "Octree-Based Sparse Voxelization Using the GPU Hardware
//! Rasterizer", OpenGL Insights, 2012: a moving average of three 8-bit channels with the count in
//! the fourth. The count stops at 255, and from then on steps below 255/2 eight-bit units are lost.
//!
//! Symbols: `quantum`: value of one integer step [unit of the samples], a power of two, so that scaling does not round;
//! `quanta_per_unit` = 1/quantum.
#define_import_path lucerna::components::voxel_light::average

#import lucerna::math::float::all_finite

/// The largest sample in quanta: the largest f32 below 2³².
const QUANTA_MAX: f32 = 4294967040.0;
/// Where the packed count stops.
const PACKED_COUNT_MAX: u32 = 255u;

/// Results of [`check_sample`]: the sample can be added.
const SAMPLE_FINE: u32 = 0u;
/// A channel is above the largest value and will be clamped.
const SAMPLE_CLAMPED: u32 = 1u;
/// A channel is NaN, infinite or negative: the sample must not be added.
const SAMPLE_REJECTED: u32 = 2u;

/// Three 64-bit integers.
struct WideSum {
    low: vec3<u32>,
    high: vec3<u32>,
}

/// Whether a sample may be added: a SAMPLE_ constant. Any f32; −0 counts as 0. `quanta_per_unit`: above 0.
fn check_sample(value: vec3<f32>, quanta_per_unit: f32) -> u32 {
    if !all_finite(value) || any(value < vec3<f32>(0.0)) {
        return SAMPLE_REJECTED;
    }
    return select(SAMPLE_FINE, SAMPLE_CLAMPED, any(value * quanta_per_unit > vec3<f32>(QUANTA_MAX)));
}

/// A sample in quanta, rounded to the nearest; above QUANTA_MAX it is clamped.
///
/// `value`: finite, not negative.
fn quantise(value: vec3<f32>, quanta_per_unit: f32) -> vec3<u32> {
    return vec3<u32>(round(min(value * quanta_per_unit, vec3<f32>(QUANTA_MAX))));
}

/// The carry of a 32-bit addition `old + added`: 0 or 1 for each channel.
fn carry_of(old: vec3<u32>, added: vec3<u32>) -> vec3<u32> {
    return select(vec3<u32>(0u), vec3<u32>(1u), old + added < added);
}

/// The sum with one more sample; exact while it is below 2⁶⁴.
fn add_to_sum(sum: WideSum, quanta: vec3<u32>) -> WideSum {
    return WideSum(sum.low + quanta, sum.high + carry_of(sum.low, quanta));
}

/// The mean in the samples' unit; 0 if there are none.
///
/// Five roundings of 2⁻²⁴ and a division of 2.5 units in the last place: relative error below 6e-7.
fn mean_of_sum(sum: WideSum, count: u32, quantum: f32) -> vec3<f32> {
    if count == 0u {
        return vec3<f32>(0.0);
    }
    let total = vec3<f32>(sum.high) * 4294967296.0 + vec3<f32>(sum.low);
    return total / f32(count) * quantum;
}

/// A value in one word: 8 bits per channel (red lowest) and a count in the highest byte.
///
/// `value_unorm`: clamped to 0..1; `count` ≤ 255.
fn pack_average(value_unorm: vec3<f32>, count: u32) -> u32 {
    let steps = vec3<u32>(round(clamp(value_unorm, vec3<f32>(0.0), vec3<f32>(1.0)) * 255.0));
    return steps.x | (steps.y << 8u) | (steps.z << 16u) | (count << 24u);
}

/// The channels of [`pack_average`], 0..1.
fn unpack_average(word: u32) -> vec3<f32> {
    return vec3<f32>((vec3<u32>(word) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(0xffu)) / 255.0;
}

/// The count of [`pack_average`].
fn unpack_count(word: u32) -> u32 {
    return word >> 24u;
}

/// The packed moving average with one more sample: m + (x − m)/n, n at most PACKED_COUNT_MAX.
fn moving_average_step(word: u32, value_unorm: vec3<f32>) -> u32 {
    let count = min(unpack_count(word) + 1u, PACKED_COUNT_MAX);
    let mean = unpack_average(word);
    let sample = clamp(value_unorm, vec3<f32>(0.0), vec3<f32>(1.0));
    return pack_average(mean + (sample - mean) / f32(count), count);
}
