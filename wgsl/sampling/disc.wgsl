// SPDX-License-Identifier: MIT OR Apache-2.0
//! Points on the unit disc.
//!
//! P. Shirley, K. Chiu, "A Low Distortion Map Between Disk and Square", JGT 2(3), 1997: concentric
//! squares become concentric circles.
#define_import_path lucerna::sampling::disc

#import lucerna::math::constants::{HALF_PI, INV_PI}

/// A uniformly distributed point with |p| ≤ 1. `u` is uniform in [0, 1)².
fn sample_uniform_disc(u: vec2<f32>) -> vec2<f32> {
    let p = 2.0 * u - 1.0;
    let along_x = abs(p.x) > abs(p.y);
    let radius = select(p.y, p.x, along_x);
    if radius == 0.0 {
        return vec2<f32>(0.0);
    }
    let turn = 0.5 * HALF_PI * select(p.x, p.y, along_x) / radius;
    let phi = select(HALF_PI - turn, turn, along_x);
    return radius * vec2<f32>(cos(phi), sin(phi));
}

/// Density of [`sample_uniform_disc`] by area: 1/π.
fn pdf_uniform_disc() -> f32 {
    return INV_PI;
}
