// SPDX-License-Identifier: MIT OR Apache-2.0
//! Layout of the memory into which samples are written, one word after the other.
//!
//! A head of HEAD_WORDS counters, then the records: one packed word each
//! (`lucerna::components::voxel_light::average`), or for STRATEGY_EXACT EXACT_WORDS words: low words of the red, green
//! and blue sum, count, high words of the three sums, one word of padding.
#define_import_path lucerna::components::voxel_light::accumulator

/// The packed value, last writer wins.
const STRATEGY_STORE: u32 = 0u;
/// The packed moving average, by compare-and-swap.
const STRATEGY_MOVING_AVERAGE: u32 = 1u;
/// The largest packed word (blue decides first).
const STRATEGY_MAX: u32 = 2u;
/// 64-bit sums of integers.
const STRATEGY_EXACT: u32 = 3u;

/// Words before the first record.
const HEAD_WORDS: u32 = 8u;
/// Word of the head that counts samples that were NaN, infinite or negative.
const HEAD_REJECTED: u32 = 0u;
/// Samples that were clamped to the largest value.
const HEAD_CLAMPED: u32 = 1u;
/// Samples outside the grid, in voxels that are not occupied, or without a record.
const HEAD_OUTSIDE: u32 = 2u;
/// Rays that were not traced because the driver ended loops early (`math::loops`).
const HEAD_CUT: u32 = 3u;

/// Words of a record with STRATEGY_EXACT; 1 with the others.
const EXACT_WORDS: u32 = 8u;
/// Within the record: the count.
const EXACT_COUNT: u32 = 3u;
/// Within the record: offset from a channel's low word to its high one.
const EXACT_HIGH: u32 = 4u;
