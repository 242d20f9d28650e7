// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: memory into which samples of many invocations are averaged.
//!
//! Interface: `accumulators`, `DepositSettings`, `VoxelSample`, `Run`, `start_run`, `deposit`, `end_run`, `count_cut`. What the words
//! hold: `lucerna::components::voxel_light::accumulator`; the arithmetic: `lucerna::components::voxel_light::average`.
//!
//! With STRATEGY_EXACT an invocation passes its samples one after the other: consecutive samples of the same record are
//! summed in registers, as a [`Run`], and written when the record changes. Integer sums do not depend on the order of
//! the invocations. The moving average uses compare-and-swap.
#define_import_path lucerna::fields::voxel_accumulators

#import lucerna::components::voxel_light::accumulator::{STRATEGY_STORE, STRATEGY_MOVING_AVERAGE, STRATEGY_MAX, STRATEGY_EXACT}
#import lucerna::components::voxel_light::accumulator::{HEAD_WORDS, HEAD_REJECTED, HEAD_CLAMPED, HEAD_OUTSIDE, HEAD_CUT, EXACT_WORDS, EXACT_COUNT, EXACT_HIGH}
#import lucerna::components::voxel_light::average::{WideSum, QUANTA_MAX, SAMPLE_FINE, SAMPLE_REJECTED}
#import lucerna::components::voxel_light::average::{check_sample, quantise, add_to_sum, carry_of, pack_average, moving_average_step, PACKED_COUNT_MAX}
#import lucerna::components::voxels::bricks::NO_SLOT

// Sums of 2³² − 1 samples fit 64 bits.
const_assert QUANTA_MAX < 4294967296.0;

/// A value on its way to a record.
struct VoxelSample {
    /// Irradiance [W·m⁻²].
    value: vec3<f32>,
    /// slot · n_faces + face; NO_SLOT and anything beyond the grid's capacity counts as outside.
    record: u32,
}

/// How samples are written.
struct DepositSettings {
    /// A STRATEGY_ constant; if it is known when the pipeline is created, the code of the others is dropped.
    strategy: u32,
    /// Number of records.
    n_records: u32,
    /// See `lucerna::components::voxel_light::average`; a power of two.
    quanta_per_unit: f32,
    /// 1/largest value, which packed words store as 1.
    unorm_per_unit: f32,
}

/// Consecutive samples of one record.
struct Run {
    sum: WideSum,
    count: u32,
    record: u32,
}

@group(3) @binding(5) var<storage, read_write> accumulators: array<atomic<u32>>;

/// An empty run.
fn start_run() -> Run {
    return Run(WideSum(vec3<u32>(0u), vec3<u32>(0u)), 0u, NO_SLOT);
}

/// Adds a channel's 64-bit sum to memory: the carry of the low word goes to the high one.
fn add_channel(low_ix: u32, low: u32, high: u32) {
    let old = atomicAdd(&accumulators[low_ix], low);
    let up = high + carry_of(vec3<u32>(old), vec3<u32>(low)).x;
    if up != 0u {
        atomicAdd(&accumulators[low_ix + EXACT_HIGH], up);
    }
}

/// Writes the sum of a run; must be called after an invocation's last [`deposit`].
fn end_run(run: Run) {
    if run.count == 0u {
        return;
    }
    let at = HEAD_WORDS + run.record * EXACT_WORDS;
    add_channel(at, run.sum.low.x, run.sum.high.x);
    add_channel(at + 1u, run.sum.low.y, run.sum.high.y);
    add_channel(at + 2u, run.sum.low.z, run.sum.high.z);
    atomicAdd(&accumulators[at + EXACT_COUNT], run.count);
}

/// Adds a sample to the packed moving average of a word. `value_unorm`: in [0, 1].
fn average_by_compare_and_swap(ix: u32, value_unorm: vec3<f32>) {
    var old = atomicLoad(&accumulators[ix]);
    loop {
        let swapped = atomicCompareExchangeWeak(&accumulators[ix], old, moving_average_step(old, value_unorm));
        if swapped.exchanged {
            break;
        }
        old = swapped.old_value;
    }
}

/// Writes a sample, or with STRATEGY_EXACT adds it to the run. Samples that are outside, not finite, negative or too large are
/// counted in the head.
fn deposit(run: ptr<function, Run>, settings: DepositSettings, sample: VoxelSample) {
    if sample.record >= settings.n_records {
        atomicAdd(&accumulators[HEAD_OUTSIDE], 1u);
        return;
    }
    let verdict = check_sample(sample.value, settings.quanta_per_unit);
    if verdict != SAMPLE_FINE {
        if verdict == SAMPLE_REJECTED {
            atomicAdd(&accumulators[HEAD_REJECTED], 1u);
            return;
        }
        atomicAdd(&accumulators[HEAD_CLAMPED], 1u);
    }
    if settings.strategy == STRATEGY_EXACT {
        if sample.record != (*run).record {
            end_run(*run);
            *run = start_run();
            (*run).record = sample.record;
        }
        (*run).sum = add_to_sum((*run).sum, quantise(sample.value, settings.quanta_per_unit));
        (*run).count += 1u;
        return;
    }
    let ix = HEAD_WORDS + sample.record;
    let value_unorm = sample.value * settings.unorm_per_unit;
    if settings.strategy == STRATEGY_MOVING_AVERAGE {
        average_by_compare_and_swap(ix, value_unorm);
    } else if settings.strategy == STRATEGY_MAX {
        atomicMax(&accumulators[ix], pack_average(value_unorm, PACKED_COUNT_MAX));
    } else if settings.strategy == STRATEGY_STORE {
        atomicStore(&accumulators[ix], pack_average(value_unorm, PACKED_COUNT_MAX));
    }
}

/// Counts rays that were not traced because the driver ended loops early (`math::loops`).
fn count_cut(n_rays: u32) {
    atomicAdd(&accumulators[HEAD_CUT], n_rays);
}
