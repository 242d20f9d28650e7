// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much a probe counts for a receiver, by their distance, and for what the receiver sees.
//!
//! A. Silvennoinen, J. Lehtinen, "Real-time Global Illumination by Precomputed Local Reconstruction from Sparse Radiance Probes", ACM TOG
//! 36(6), 2017.
#define_import_path lucerna::components::sparse_probes::support

/// Points nearer than its root [radii] are as well resolved as one another.
const LEAST_RESOLVED: f32 = 0.01;

/// w(t) = 2t³ − 3t² + 1 with t = `distance`/`radius`; 0 beyond the radius. `distance` ≥ 0, `radius` > 0, in the same unit.
fn support_weight(distance: f32, radius: f32) -> f32 {
    let t = min(distance / radius, 1.0);
    return (2.0 * t - 3.0) * t * t + 1.0;
}

/// How much more a probe counts for a point that it sees than it counts for the receiver, at most 1/LEAST_RESOLVED. A probe's harmonics blur by an
/// angle, and so by a width on surfaces that grows with their distance: so does the error of what it tells of a point, and independent estimates are
/// best weighed by 1/error². `distance`: from the probe to the point, ≥ 0; `radius` > 0, in the same unit. This is our own.
fn resolution_weight(distance: f32, radius: f32) -> f32 {
    let t = distance / radius;
    return 1.0 / (t * t + LEAST_RESOLVED);
}
