// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fills cells that have no surface, between two opposite neighbours that have one.
//!
//! The voxelizer misses no surface; gaps are slits narrower than a cell, and the steps of slanted surfaces. A face has
//! two pairs of opposite neighbours, one along each of the other axes. Units: texels of `cone::medium`.
#define_import_path lucerna::components::voxel_pyramid::gaps

/// Pairs that have a surface on both sides, so far. All zero: none.
struct GapPairs {
    /// Sum of the pairs' mean texels.
    sum: vec4<f32>,
    n: f32,
}

/// Step from a cell to the second neighbour of pair 0 or 1 of a face (0 to 5); the first neighbour is in the opposite
/// direction.
fn gap_step(face: u32, pair: u32) -> vec3<i32> {
    var step = vec3<i32>(0);
    step[((face >> 1u) + 1u + pair) % 3u] = 1;
    return step;
}

/// Adds the texels of a pair, if both have a surface (a > 0).
fn add_gap_pair(pairs: GapPairs, one: vec4<f32>, other: vec4<f32>) -> GapPairs {
    if one.a > 0.0 && other.a > 0.0 {
        return GapPairs(pairs.sum + 0.5 * (one + other), pairs.n + 1.0);
    }
    return pairs;
}

/// The texel of the gap: the mean of the pairs; zeros if there are none.
fn texel_of_gap(pairs: GapPairs) -> vec4<f32> {
    return pairs.sum / max(pairs.n, 1.0);
}
