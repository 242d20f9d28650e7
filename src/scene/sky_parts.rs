// SPDX-License-Identifier: MIT OR Apache-2.0
//! Skies of which every smooth sky is a weighted sum, so that light that was baked for each of them is, as a weighted sum, that of any sky.
//!
//! A sky is taken as spherical harmonics of order 2: the first part is the constant 1, the others are 1 + Yₖ/cₖ with cₖ the greatest
//! value of |Yₖ|, because radiance is not negative. Light is linear, so with L = Σ aₖYₖ the light is that of Σ wₖ times the parts, with wₖ
//! = aₖcₖ and w₀ = a₀Y₀ − Σ wₖ (P.-P. Sloan, J. Kautz, J. Snyder, "Precomputed Radiance Transfer", SIGGRAPH 2002, for a sky).

use super::Sky;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// How many parts there are.
pub const N_SKY_PARTS: usize = 9;

/// Texels along the longer side of a part's picture: between them, bilinear interpolation is off by less than 1e-3.
const WIDTH: u32 = 128;

/// The functions of order 2 (`wgsl/sh/basis.wgsl`).
fn basis(d: DVec3) -> [f64; N_SKY_PARTS] {
    let root = |x: f64| (x / PI).sqrt();
    let DVec3 { x, y, z } = d;
    [
        root(0.25),
        root(0.75) * y,
        root(0.75) * z,
        root(0.75) * x,
        root(3.75) * x * y,
        root(3.75) * y * z,
        root(0.3125) * (3.0 * z * z - 1.0),
        root(3.75) * x * z,
        root(0.9375) * (x * x - y * y),
    ]
}

/// The greatest value of each function.
fn greatest() -> [f64; N_SKY_PARTS] {
    let root = |x: f64| (x / PI).sqrt();
    let (one, two) = (root(0.75), 0.5 * root(3.75));
    [root(0.25), one, one, one, two, two, 2.0 * root(0.3125), two, root(0.9375)]
}

/// Calls `each` with the direction and the solid angle \[sr\] of each texel of an equirectangular picture, row by row.
fn each_texel(width: u32, height: u32, mut each: impl FnMut(DVec3, f64)) {
    for row in 0..height {
        let [top, bottom] = [row, row + 1].map(|v| PI * f64::from(v) / f64::from(height));
        let solid = (top.cos() - bottom.cos()) * 2.0 * PI / f64::from(width);
        let (sin, cos) = (0.5 * (top + bottom)).sin_cos();
        for column in 0..width {
            let phi = 2.0 * PI * (f64::from(column) + 0.5) / f64::from(width);
            each(DVec3::new(sin * phi.sin(), cos, -sin * phi.cos()), solid);
        }
    }
}

/// A part, `ix` below [`N_SKY_PARTS`] \[W·sr⁻¹·m⁻²\].
///
/// # Panics
/// If there is no such part.
pub fn sky_part(ix: usize) -> Sky {
    assert!(ix < N_SKY_PARTS, "part {ix} of a sky");
    if ix == 0 {
        return Sky::Constant(Vec3::ONE);
    }
    let (width, height) = (WIDTH, WIDTH / 2);
    let mut rgb = Vec::new();
    each_texel(width, height, |direction, _| {
        let value = 1.0 + basis(direction)[ix] / greatest()[ix];
        rgb.push(Vec3::splat(value.max(0.0) as f32));
    });
    Sky::Image { width, height, rgb }
}

/// How much of each part makes a sky, and what share of it is lost: the root of the mean squared difference between the sky and the sum of
/// its parts, by the root of the sky's own mean square. 0 for a constant, near 1 for a small bright sun.
pub fn sky_part_weights(sky: &Sky) -> ([Vec3; N_SKY_PARTS], f32) {
    let (width, height, rgb) = match sky {
        Sky::Constant(radiance) => {
            let mut weights = [Vec3::ZERO; N_SKY_PARTS];
            weights[0] = *radiance;
            return (weights, 0.0);
        }
        Sky::Image { width, height, rgb } => (*width, *height, rgb),
    };
    let mut a = [DVec3::ZERO; N_SKY_PARTS];
    let mut texels = rgb.iter().map(|texel| texel.as_dvec3());
    let (mut square, mut all) = (0.0, [0.0; N_SKY_PARTS]);
    each_texel(width, height, |direction, solid| {
        let radiance = texels.next().unwrap_or(DVec3::ZERO);
        square += solid * radiance.length_squared();
        for ((a, norm), y) in a.iter_mut().zip(&mut all).zip(basis(direction)) {
            *a += radiance * (solid * y);
            *norm += solid * y * y;
        }
    });
    // (A picture of a few texels knows the functions only about.)
    for (a, norm) in a.iter_mut().zip(all) {
        *a /= norm.max(f64::MIN_POSITIVE);
    }
    let kept: f64 = a.iter().zip(all).map(|(a, norm)| a.length_squared() * norm).sum();
    let lost = if square > 0.0 { (1.0 - kept / square).max(0.0).sqrt() } else { 0.0 };
    let mut weights: [DVec3; N_SKY_PARTS] = std::array::from_fn(|ix| a[ix] * greatest()[ix]);
    weights[0] -= weights[1..].iter().sum::<DVec3>();
    (weights.map(|w| w.as_vec3()), lost as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, of: impl Fn(DVec3) -> DVec3) -> Sky {
        let mut rgb = Vec::new();
        each_texel(width, width / 2, |d, _| rgb.push(of(d).as_vec3()));
        Sky::Image { width, height: width / 2, rgb }
    }

    /// The parts, times the weights of a sky of order 2, are the sky, in every direction; nothing is lost. Tolerance: the sums over a picture
    /// of 256 × 128 texels are off by less than 1e-3.
    #[test]
    fn parts_add_up_to_the_sky() {
        let sky = |d: DVec3| {
            DVec3::new(2.0, 1.5, 3.0)
                + DVec3::new(0.6, 0.1, -0.9) * d.y
                + DVec3::new(-0.2, 0.3, 0.4) * d.x * d.z
                + DVec3::new(0.1, 0.0, 0.5) * (d.z * d.z - d.x * d.y)
        };
        let (weights, lost) = sky_part_weights(&picture(256, sky));
        assert!(lost < 0.01, "{lost} of a smooth sky is lost");
        for ix in 0..200 {
            let z = 1.0 - 2.0 * (f64::from(ix) + 0.5) / 200.0;
            let (sin, cos) = (f64::from(ix) * 2.4).sin_cos();
            let flat = (1.0 - z * z).sqrt();
            let d = DVec3::new(flat * cos, flat * sin, z);
            let part = |k: usize| if k == 0 { 1.0 } else { 1.0 + basis(d)[k] / greatest()[k] };
            let found: DVec3 = (0..N_SKY_PARTS).map(|k| weights[k].as_dvec3() * part(k)).sum();
            let off = (found - sky(d)).abs().max_element();
            assert!(off < 3e-3, "towards {d}: {found}, expected {}", sky(d));
        }
    }

    #[test]
    fn parts_are_skies_and_losses_are_told() {
        for ix in 0..N_SKY_PARTS {
            let (weights, lost) = sky_part_weights(&sky_part(ix));
            for (k, weight) in weights.iter().enumerate() {
                let expected = if k == ix { 1.0 } else { 0.0 };
                assert!((*weight - expected).abs().max_element() < 2e-3, "part {ix}: {weights:?}");
            }
            assert!(lost < 0.02, "part {ix}: {lost}");
            if let Sky::Image { rgb, .. } = sky_part(ix) {
                let (low, high) = (0.0..0.02, 1.5..2.01);
                let least = rgb.iter().map(|c| c.x).fold(f32::INFINITY, f32::min);
                let most = rgb.iter().map(|c| c.x).fold(0.0, f32::max);
                assert!(high.contains(&most) && least >= low.start, "part {ix}: {least} to {most}");
            }
        }
        let sun = picture(256, |d| DVec3::splat(if d.y > 0.99 { 100.0 } else { 0.1 }));
        assert!(sky_part_weights(&sun).1 > 0.8, "a sun");
        let red = Vec3::new(2.0, 0.0, 0.0);
        assert_eq!(sky_part_weights(&Sky::Constant(red)).0[0], red);
        assert_eq!(sky_part_weights(&picture(4, |_| DVec3::ZERO)), ([Vec3::ZERO; 9], 0.0));
    }
}
