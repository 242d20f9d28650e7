// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much a probe counts for a receiver, by their distance.
//!
//! A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG
//! 36(6), 2017.
#define_import_path lucerna::components::sparse_probes::support

/// w(t) = 2t³ − 3t² + 1 with t = `distance`/`radius`; 0 beyond the radius. `distance` ≥ 0, `radius` > 0, in the same unit.
fn support_weight(distance: f32, radius: f32) -> f32 {
    let t = min(distance / radius, 1.0);
    return (2.0 * t - 3.0) * t * t + 1.0;
}
