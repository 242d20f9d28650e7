// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cones that share the hemisphere between them: for irradiance, E = π·Σ weight·L.
//!
//! n cones of equal solid angle 2π/n. The first stands around the normal, the others in one ring (5, 6,
//! 9 cones), or in rings of 5 and 10 (16 cones). A cone's part of the hemisphere is a zone between two cosines,
//! divided evenly: its weight is ∫cosθ dω/π over that, and its elevation is where cosθ has its mean by that weight, so that light
//! that changes linearly with cosθ is integrated exactly (by the rings; by the first cone up to 6 %).
//!
//! | cones | half aperture | weights | elevations from the normal |
//! |---|---|---|---|
//! | 5 | 36.9° | 0.36, 4 × 0.16 | 0°, 57.8° |
//! | 6 | 33.6° | 0.306, 5 × 0.139 | 0°, 56.3° |
//! | 9 | 27.3° | 0.210, 8 × 0.0988 | 0°, 53.7° |
//! | 16 | 20.4° | 0.121, 5 × 0.0977, 10 × 0.0391 | 0°, 37.6°, 65.4° |
#define_import_path lucerna::cone::cone_set

#import lucerna::math::constants::TWO_PI

/// A cone of a set, around +Z.
struct SetCone {
    /// Unit length.
    direction: vec3<f32>,
    /// Share of a white surface's irradiance under even light; they sum to 1.
    weight: f32,
}

/// tan of half the aperture of each of n cones: cos = 1 − 1/n.
fn set_spread(n: u32) -> f32 {
    let cosine = 1.0 - 1.0 / f32(n);
    return sqrt(1.0 - cosine * cosine) / cosine;
}

/// Cone `ix` of n, which is 5, 6, 9 or 16 (any n ≥ 2 gives a set of one ring). `turn`: how far the set is
/// turned about the normal, in [0, 1) turns.
fn cone_of_set(n: u32, ix: u32, turn: f32) -> SetCone {
    let share = 1.0 / f32(n);
    // The zones' borders as cosines.
    let first = 1.0 - share;
    if ix == 0u {
        return SetCone(vec3<f32>(0.0, 0.0, 1.0), 1.0 - first * first);
    }
    let has_two_rings = n == 16u;
    let n_inner = select(n - 1u, 5u, has_two_rings);
    let is_outer = ix > n_inner;
    let n_ring = select(n_inner, n - 1u - n_inner, is_outer);
    let place = select(ix - 1u, ix - 1u - n_inner, is_outer);
    let middle = select(0.0, 10.0 * share, has_two_rings);
    let high = select(first, middle, is_outer);
    let low = select(middle, 0.0, is_outer);
    let zone = high * high - low * low;
    let cosine = (2.0 / 3.0) * (high * high * high - low * low * low) / zone;
    let sine = sqrt(1.0 - cosine * cosine);
    let phi = TWO_PI * (turn + (f32(place) + select(0.0, 0.5, is_outer)) / f32(n_ring));
    return SetCone(vec3<f32>(sine * cos(phi), sine * sin(phi), cosine), zone / f32(n_ring));
}
