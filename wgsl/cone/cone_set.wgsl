// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sets of cones that divide the hemisphere between them: for irradiance, E = π·Σ weight·L.
//!
//! n cones of equal solid angle 2π/n. The first is around the normal, the others are in one ring (5, 6, 9 cones), or in
//! rings of 5 and 10 (16 cones). A cone's part of the hemisphere is a zone between two cosines, divided evenly: its
//! weight is ∫cosθ dω/π over this part, and its elevation is where cosθ equals its mean by that weight, so that light
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
    /// Share of a white surface's irradiance under uniform light; they sum to 1.
    weight: f32,
}

/// tan of half the aperture of each of n cones: cos = 1 − 1/n.
fn set_spread(n: u32) -> f32 {
    let cosine = 1.0 - 1.0 / f32(n);
    return sqrt(1.0 - cosine * cosine) / cosine;
}

/// A cone's part of the hemisphere: a zone between two cosines, and one of `n_ring` equal sectors of it.
struct SetPart {
    low: f32,
    high: f32,
    n_ring: u32,
    /// Which sector; half numbers are between those of the inner ring.
    place: f32,
}

/// Part `ix` of n (`cone_of_set`).
fn part_of_set(n: u32, ix: u32) -> SetPart {
    let share = 1.0 / f32(n);
    let first = 1.0 - share;
    if ix == 0u {
        return SetPart(first, 1.0, 1u, 0.0);
    }
    let has_two_rings = n == 16u;
    let n_inner = select(n - 1u, 5u, has_two_rings);
    let middle = select(0.0, 10.0 * share, has_two_rings);
    if ix > n_inner {
        return SetPart(0.0, middle, n - 1u - n_inner, f32(ix - 1u - n_inner) + 0.5);
    }
    return SetPart(middle, first, n_inner, f32(ix - 1u));
}

/// Direction of a cosine to +Z and an azimuth in turns.
fn direction_at(cosine: f32, turns: f32) -> vec3<f32> {
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    return vec3<f32>(sine * cos(TWO_PI * turns), sine * sin(TWO_PI * turns), cosine);
}

/// Cone `ix` of n, which is 5, 6, 9 or 16 (any other n ≥ 2 gives one ring), along the middle of its part. `turn`:
/// rotation of the set about the normal, in [0, 1) turns.
fn cone_of_set(n: u32, ix: u32, turn: f32) -> SetCone {
    let part = part_of_set(n, ix);
    let zone = part.high * part.high - part.low * part.low;
    if ix == 0u {
        return SetCone(vec3<f32>(0.0, 0.0, 1.0), zone);
    }
    let cubes = part.high * part.high * part.high - part.low * part.low * part.low;
    let cosine = (2.0 / 3.0) * cubes / zone;
    let n_ring = f32(part.n_ring);
    return SetCone(direction_at(cosine, turn + part.place / n_ring), zone / n_ring);
}

/// The same cone along a direction sampled from its part, in proportion to the cosine: over many samples the set
/// integrates any light without bias, however small the cells are that the cones read. `u`: uniform in [0, 1)².
fn drawn_cone_of_set(n: u32, ix: u32, u: vec2<f32>) -> SetCone {
    let part = part_of_set(n, ix);
    let low = part.low * part.low;
    let high = part.high * part.high;
    return SetCone(
        direction_at(sqrt(mix(low, high, u.x)), (part.place + u.y) / f32(part.n_ring)),
        (high - low) / f32(part.n_ring),
    );
}
