// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is gathered for a probe, before it is packed: spherical harmonics of order 2 in f32, and how well they are known.
//!
//! COEFFICIENTS `vec4<f32>` for each probe. rgb: coefficient of the radiance that arrives and was reflected at least once
//! [W·sr⁻¹·m⁻²], the mean over all paths. The a of the first four: paths; mean and sum of squared differences of the batches'
//! constants (luminance); 1 if the probe has stopped.
#define_import_path lucerna::components::probes::gathered

/// Coefficients of a probe.
const COEFFICIENTS: u32 = 9u;

/// Paths of a batch.
const BATCH: f32 = 64.0;

/// What batches of paths have found so far, as in B. P. Welford, "Note on a Method for Calculating Corrected Sums of Squares and
/// Products", Technometrics 4(3), 1962.
struct Batches {
    n: f32,
    mean: f32,
    /// Sum of squared differences from the mean.
    squares: f32,
}

/// The batches with one more, which found `value`.
fn with_batch(known: Batches, value: f32) -> Batches {
    let n = known.n + 1.0;
    let before = value - known.mean;
    let mean = known.mean + before / n;
    return Batches(n, mean, known.squares + before * (value - mean));
}

/// Whether the mean of at least eight batches is known: its standard error is at most `noise` times it. (Batches of one low-discrepancy
/// sequence complement each other, so the error is less.)
fn is_known(batches: Batches, noise: f32) -> bool {
    let variance = batches.squares / max((batches.n - 1.0) * batches.n, 1.0);
    return batches.n >= 8.0 && variance <= noise * noise * batches.mean * batches.mean;
}
