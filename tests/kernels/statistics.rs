// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests, and quadrature over directions: the library's own, `lucerna::testing`.

pub use lucerna::testing::{Chart, assert_chi_square, square_bins};

use glam::DVec3;
use lucerna::testing::chi_square_limit;
use std::f64::consts::PI;

/// The mean of a function of the direction over the hemisphere around a unit normal, weighted by the cosine: n × n
/// midpoints.
pub fn over_hemisphere(normal: DVec3, n: u32, f: impl Fn(DVec3) -> f64) -> f64 {
    let (x, y) = normal.any_orthonormal_pair();
    let middle = |ix: u32| (f64::from(ix) + 0.5) / f64::from(n);
    let places = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let values = places.map(|(i, j)| {
        let (sine, turn) = (middle(i).sqrt(), 2.0 * PI * middle(j));
        let cosine = (1.0 - sine * sine).sqrt();
        f(sine * (turn.cos() * x + turn.sin() * y) + cosine * normal)
    });
    values.sum::<f64>() / f64::from(n * n)
}

/// How far it is along a direction out of the cube of 8 m around the origin.
pub fn way_out_of_cube(start: DVec3, direction: DVec3) -> f64 {
    (0..3)
        .map(|k| (4.0 * direction[k].signum() - start[k]) / direction[k])
        .fold(f64::INFINITY, f64::min)
}

/// Against quantiles of 1 − 2.001e-6 (0.1 % over 500 tests), by mpmath from the incomplete gamma function.
#[test]
fn chi_square_limit_matches_tables() {
    for (dof, value) in
        [(4, 31.904_531_3), (10, 45.200_343_9), (100, 179.171_771), (400, 544.176_672)]
    {
        let limit = chi_square_limit(dof);
        let off = (limit / value - 1.0).abs();
        assert!(off < 1e-6, "{dof} degrees of freedom: {limit}, expected {value} to 1e-6");
    }
}
