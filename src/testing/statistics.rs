// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests, and quadrature over directions.

use super::level_of_comparison;
use glam::DVec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::{PI, TAU};

/// Bins that expect fewer samples are pooled, because their counts are far from normally distributed.
const MIN_EXPECTED: f64 = 10.0;

/// The value that chi-square of `dof` ≥ 1 degrees of freedom exceeds by chance in one of 500 000 tests
/// ([`level_of_comparison`]).
///
/// # Panics
/// If `dof` is 0.
pub fn chi_square_limit(dof: usize) -> f64 {
    let distribution = ChiSquared::new(dof as f64).expect("at least one degree of freedom");
    distribution.inverse_cdf(1.0 - level_of_comparison(1))
}

/// Fails if counts differ from expected ones by more than chance ([`chi_square_limit`]), by Pearson's chi-square
/// over the bins. Bins that expect fewer than 10 samples are merged into one; at least 4 bins must remain.
///
/// Returns the statistic in units of its limit.
///
/// # Panics
/// If the counts differ by more, a bin that expects no samples has some, or the sums of both differ by a thousandth.
pub fn assert_chi_square(what: &str, observed: &[u64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len());
    let n: u64 = observed.iter().sum();
    let total: f64 = expected.iter().sum();
    assert!(
        (n as f64 - total).abs() < 1e-3 * n as f64,
        "{what}: {n} samples, {total} expected over all bins"
    );
    let (mut statistic, mut n_bins) = (0.0, 0);
    let mut pool = (0u64, 0.0);
    for (ix, (&o, &e)) in observed.iter().zip(expected).enumerate() {
        assert!(e > 0.0 || o == 0, "{what}: {o} samples in bin {ix}, which expects none");
        if e < MIN_EXPECTED {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            statistic += (o as f64 - e).powi(2) / e;
            n_bins += 1;
        }
    }
    if pool.1 >= MIN_EXPECTED {
        statistic += (pool.0 as f64 - pool.1).powi(2) / pool.1;
        n_bins += 1;
    }
    assert!(n_bins >= 4, "{what}: only {n_bins} bins");
    let limit = chi_square_limit(n_bins - 1);
    assert!(statistic < limit, "{what}: chi-square {statistic:.1} over {limit:.1}, {n_bins} bins");
    statistic / limit
}

/// Counts of points in `n[0]` × `n[1]` bins over [0, 1)², the first coordinate fastest.
///
/// # Panics
/// If a point is outside.
pub fn square_bins(points: impl IntoIterator<Item = [f64; 2]>, n: [usize; 2]) -> Vec<u64> {
    let mut counts = vec![0; n[0] * n[1]];
    for [x, y] in points {
        assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y), "({x}, {y}) outside [0, 1)²");
        counts[(y * n[1] as f64) as usize * n[0] + (x * n[0] as f64) as usize] += 1;
    }
    counts
}

/// The sphere as a square: cos θ = 1 − 2a^power about an axis, φ = 2πb. A power above 1 makes the
/// bins near the axis smaller.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    frame: [DVec3; 3],
    power: f64,
    /// Bins over a and b.
    n: [usize; 2],
}

impl Chart {
    /// About +Z with bins of equal size.
    pub fn uniform(n: [usize; 2]) -> Self {
        Self::about(DVec3::Z, 1.0, n)
    }

    /// About an axis. `power` ≥ 1: a larger one makes the bins near the axis smaller.
    pub fn about(axis: DVec3, power: f64, n: [usize; 2]) -> Self {
        let axis = axis.normalize();
        let x = axis.any_orthonormal_vector();
        Self { frame: [x, axis.cross(x), axis], power, n }
    }

    fn direction(&self, a: f64, b: f64) -> DVec3 {
        let below_one = 2.0 * a.powf(self.power);
        let r = (below_one * (2.0 - below_one)).max(0.0).sqrt();
        let (sin, cos) = (TAU * b).sin_cos();
        let [x, y, z] = self.frame;
        x * (r * cos) + y * (r * sin) + z * (1.0 - below_one)
    }

    /// dω/(da db).
    fn jacobian(&self, a: f64) -> f64 {
        4.0 * PI * self.power * a.powf(self.power - 1.0)
    }

    /// Counts of the directions (unit length) per bin.
    pub fn count(&self, directions: impl IntoIterator<Item = DVec3>) -> Vec<u64> {
        let [na, nb] = self.n;
        let mut counts = vec![0; na * nb];
        for d in directions {
            let a = ((d - self.frame[2]).length_squared() / 4.0).powf(1.0 / self.power);
            let b = d.dot(self.frame[1]).atan2(d.dot(self.frame[0])).rem_euclid(TAU) / TAU;
            let (i, j) = ((a * na as f64) as usize, (b * nb as f64) as usize);
            counts[j.min(nb - 1) * na + i.min(na - 1)] += 1;
        }
        counts
    }

    /// ∫ density dω per bin by the midpoint rule on `sub`² points a bin.
    pub fn integrate(&self, sub: usize, density: impl Fn(DVec3) -> f64) -> Vec<f64> {
        let [na, nb] = self.n;
        let mut out = vec![0.0; na * nb];
        let (ma, mb) = (na * sub, nb * sub);
        for j in 0..mb {
            for i in 0..ma {
                let (a, b) = ((i as f64 + 0.5) / ma as f64, (j as f64 + 0.5) / mb as f64);
                out[j / sub * na + i / sub] += density(self.direction(a, b)) * self.jacobian(a);
            }
        }
        let cell = 1.0 / (ma * mb) as f64;
        out.iter_mut().for_each(|value| *value *= cell);
        out
    }

    /// Directions and solid angles of a midpoint rule on na × nb points.
    pub fn nodes(&self, na: usize, nb: usize) -> Vec<(DVec3, f64)> {
        let mut out = Vec::with_capacity(na * nb);
        for j in 0..nb {
            for i in 0..na {
                let (a, b) = ((i as f64 + 0.5) / na as f64, (j as f64 + 0.5) / nb as f64);
                out.push((self.direction(a, b), self.jacobian(a) / (na * nb) as f64));
            }
        }
        out
    }
}
