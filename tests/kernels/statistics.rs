// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests, and quadrature over directions: the library's own, `lucerna::testing`.

pub use lucerna::testing::{Chart, assert_chi_square, square_bins};

use lucerna::testing::chi_square_limit;

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
