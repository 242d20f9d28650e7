// SPDX-License-Identifier: MIT OR Apache-2.0
//! Chi-square tests, and quadrature over directions: the library's own, `lucerna::testing`.

pub use lucerna::testing::{Chart, assert_chi_square, square_bins};

use lucerna::testing::chi_square_limit;

/// Against quantiles from the closed form for even degrees of freedom: at most 6 % above.
#[test]
fn chi_square_limit_matches_tables() {
    for (dof, value) in [(4, 33.3768), (10, 46.8630), (100, 182.1268), (400, 549.1152)] {
        let limit = chi_square_limit(dof);
        assert!((0.0..0.06).contains(&(limit / value - 1.0)), "{dof}: {limit}");
    }
}
