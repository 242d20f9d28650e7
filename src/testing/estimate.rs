// SPDX-License-Identifier: MIT OR Apache-2.0
//! Judges random estimates by their own standard errors.

use super::Tolerance;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// The probability that a correct program fails any of [`N_STATISTICAL_TESTS`] tests that judge by chance: 0.1 %. (Seeds
/// are fixed, so a test that passes once passes always; the level says how much a failure after a change means.)
pub const SUITE_LEVEL: f64 = 1e-3;

/// Upper bound of the number of tests in a suite that judge by chance.
pub const N_STATISTICAL_TESTS: u32 = 500;

/// The share of [`SUITE_LEVEL`] of one of `n` comparisons in one of the suite's tests: 1 − (1 − α)^(1/(n·tests)) (Z. Šidák,
/// "Rectangular Confidence Regions for the Means of Multivariate Normal Distributions", JASA 62, 1967).
pub fn level_of_comparison(n: usize) -> f64 {
    let n = n.max(1) as f64 * f64::from(N_STATISTICAL_TESTS);
    -((-SUITE_LEVEL).ln_1p() / n).exp_m1()
}

/// How many standard errors chance may put between an estimate and the truth, in one of `n` comparisons, if the standard
/// error is known, as that of a share: a quantile of the normal distribution.
pub fn normal_limit(n: usize) -> f64 {
    -Normal::standard().inverse_cdf(0.5 * level_of_comparison(n))
}

/// The mean of independent samples, and how well they determine it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The samples' mean.
    pub mean: f64,
    /// Its standard error, from the samples' variance.
    pub error: f64,
    /// Number of samples.
    pub n: usize,
}

impl Estimate {
    /// From samples that are independent of each other and of about normal distribution, such as means of many draws with
    /// different seeds; at least 8, because fewer say little about their variance.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn of(samples: impl IntoIterator<Item = f64>) -> Self {
        let samples: Vec<f64> = samples.into_iter().collect();
        assert!(samples.len() >= 8, "{} samples say little about their variance", samples.len());
        let n = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, error: (variance / n).sqrt(), n: samples.len() }
    }

    /// How many standard errors chance may put between this and the truth, in one of `n_comparisons`: Student's t.
    pub fn limit(&self, n_comparisons: usize) -> f64 {
        let dof = (self.n - 1) as f64;
        let of_t = StudentsT::new(0.0, 1.0, dof).expect("at least 7 degrees of freedom");
        -of_t.inverse_cdf(0.5 * level_of_comparison(n_comparisons))
    }
}

/// Fails if an estimate differs from what is expected by more than chance and `bias` explain: |mean − expected| ≤ t·error +
/// bias, where t is Student's at [`level_of_comparison`]. `bias`: what is not chance, such as rounding.
///
/// `resolves`: the deviation that the test must be able to see; if t·error + bias is larger, it fails as too noisy.
///
/// Returns the largest deviation in units of its bound, at most 1.
///
/// # Panics
/// If an estimate is off, not finite, or too noisy, or the numbers of estimates and expected values differ. The message
/// counts the failures and shows the worst.
pub fn assert_estimates(
    what: &str,
    estimates: &[Estimate],
    expected: &[f64],
    bias: Tolerance,
    resolves: Tolerance,
) -> f64 {
    let n = estimates.len();
    assert_eq!(n, expected.len(), "{what}: the numbers of estimates and expected values differ");
    let (mut worst, mut worst_ix, mut n_off) = (0.0, 0, 0);
    for (ix, (estimate, &truth)) in estimates.iter().zip(expected).enumerate() {
        let bound = estimate.limit(n) * estimate.error + bias.around(truth);
        let visible = resolves.around(truth);
        assert!(
            bound <= visible,
            "{what}: estimate {ix} of {n}, {estimate:?}, expected {truth}, is too noisy: chance and bias explain {bound:e}, and it must show {visible:e}"
        );
        let off = match (estimate.mean - truth).abs() {
            0.0 => 0.0,
            off if off.is_nan() => f64::INFINITY,
            off => off / bound,
        };
        n_off += usize::from(off > 1.0);
        if off > worst {
            (worst, worst_ix) = (off, ix);
        }
    }
    if n_off > 0 {
        let Estimate { mean, error, .. } = estimates[worst_ix];
        let (truth, t) = (expected[worst_ix], estimates[worst_ix].limit(n));
        panic!(
            "{what}: {n_off} of {n} estimates are off; the worst, number {worst_ix}, is {mean} ± {error:e}, expected {truth}: \
             {:e} apart, and chance ({t:.2} standard errors at a level of {:.1e}) and bias explain {:e}",
            (mean - truth).abs(),
            level_of_comparison(n),
            t * error + bias.around(truth),
        );
    }
    worst
}

/// [`assert_estimates`] of one.
///
/// # Panics
/// As [`assert_estimates`].
pub fn assert_estimate(
    what: &str,
    estimate: Estimate,
    expected: f64,
    bias: Tolerance,
    resolves: Tolerance,
) -> f64 {
    assert_estimates(what, &[estimate], &[expected], bias, resolves)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Normal samples by Box and Muller, whose true mean is known.
    fn estimates(seed: u64, n: usize, n_samples: usize, mean: f64) -> Vec<Estimate> {
        let mut random = Random(seed);
        let mut normal = || {
            let (u, v) = (1.0 - f64::from(random.unit()), f64::from(random.unit()));
            (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        };
        (0..n).map(|_| Estimate::of((0..n_samples).map(|_| mean + normal()))).collect()
    }

    #[test]
    fn levels_add_up_to_the_suites() {
        let n = 7 * N_STATISTICAL_TESTS as i32;
        let all = 1.0 - (1.0 - level_of_comparison(7)).powi(n);
        assert!((all / SUITE_LEVEL - 1.0).abs() < 1e-9, "{all}, expected {SUITE_LEVEL}");
    }

    /// Quantiles of Student's t, by mpmath with 30 digits from the incomplete beta function.
    #[test]
    fn limits_are_students() {
        for (dof, p, expected) in [
            (31.0, 5e-4, 3.633_456_350),
            (63.0, 5e-7, 5.420_029_671),
            (31.0, 1e-9, 8.344_316_303),
            (15.0, 1e-9, 12.692_733_381),
            (7.0, 1e-10, 53.835_579_385),
        ] {
            let found = StudentsT::new(0.0, 1.0, dof).map(|t| -t.inverse_cdf(p));
            let found = found.unwrap_or(f64::NAN);
            assert!(
                (found / expected - 1.0).abs() < 1e-6,
                "{dof} degrees of freedom, p = {p:e}: {found}, expected {expected}"
            );
        }
    }

    #[test]
    fn truth_passes_and_a_shift_fails() {
        let found = estimates(1, 400, 32, 3.0);
        let (truth, none) = (vec![3.0; 400], Tolerance::EXACT);
        let worst = assert_estimates("normal", &found, &truth, none, Tolerance::absolute(3.0));
        assert!((0.3..1.0).contains(&worst), "{worst}");
        let mut shifted = found.clone();
        shifted[77].mean += 2.5;
        let failed = std::panic::catch_unwind(|| {
            assert_estimates("shifted", &shifted, &truth, none, Tolerance::absolute(3.0))
        });
        let message = *failed.unwrap_err().downcast::<String>().unwrap();
        assert!(
            message.starts_with("shifted: 1 of 400 estimates are off; the worst, number 77"),
            "{message}"
        );
    }

    #[test]
    #[should_panic(expected = "too noisy")]
    fn a_test_that_sees_nothing_fails() {
        let found = estimates(2, 1, 16, 1.0);
        assert_estimate("noise", found[0], 1.0, Tolerance::EXACT, Tolerance::relative(0.01));
    }

    #[test]
    #[should_panic(expected = "are off")]
    fn nan_fails() {
        let found = Estimate { mean: f64::NAN, error: 0.0, n: 16 };
        assert_estimate("NaN", found, 1.0, Tolerance::EXACT, Tolerance::relative(0.01));
    }
}
