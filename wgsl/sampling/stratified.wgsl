// SPDX-License-Identifier: MIT OR Apache-2.0
//! Jittered points: one in each cell of a regular grid.
//!
//! R. Cook, "Stochastic Sampling in Computer Graphics", ACM TOG 5(1), 1986.
#define_import_path lucerna::sampling::stratified

#import lucerna::math::constants::ONE_BELOW

/// The point of stratum `ix` of `n` on [0, 1): (ix + jitter)/n.
///
/// `ix` < `n` ≤ 2²⁴; `jitter`: uniform in [0, 1). Rounding may move a jitter within ix·6e-8 of 1 to the next stratum's
/// border, but never to 1.
fn stratified_number(ix: u32, n: u32, jitter: f32) -> f32 {
    return min((f32(ix) + jitter) / f32(n), ONE_BELOW);
}

/// The point of a cell of `n`.x × `n`.y on [0, 1)². `cell` < `n`; `jitter`: uniform in [0, 1)².
fn stratified_in_cell(cell: vec2<u32>, n: vec2<u32>, jitter: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(stratified_number(cell.x, n.x, jitter.x), stratified_number(cell.y, n.y, jitter.y));
}

/// The point of cell `ix` of `n`.x × `n`.y on [0, 1)²; cells run along x first.
///
/// `ix` < n.x·n.y; `jitter`: uniform in [0, 1)².
fn stratified_point(ix: u32, n: vec2<u32>, jitter: vec2<f32>) -> vec2<f32> {
    return stratified_in_cell(vec2<u32>(ix % n.x, ix / n.x), n, jitter);
}
