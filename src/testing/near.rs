// SPDX-License-Identifier: MIT OR Apache-2.0
//! Compares outputs with an oracle.

use super::golden;
use std::fmt::Debug;

/// Number of failures that a message shows.
const SHOWN: usize = 5;

/// How far a number may be from what is expected: the sum of three parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// An absolute error.
    pub absolute: f64,
    /// An error relative to the expected value's magnitude.
    pub relative: f64,
    /// An error in units of the distance between neighbouring f32 around the expected value.
    pub ulps: f64,
}

impl Tolerance {
    /// No tolerance.
    pub const EXACT: Self = Self { absolute: 0.0, relative: 0.0, ulps: 0.0 };

    /// An absolute tolerance.
    pub const fn absolute(absolute: f64) -> Self {
        Self { absolute, ..Self::EXACT }
    }

    /// A tolerance relative to the expected value.
    pub const fn relative(relative: f64) -> Self {
        Self { relative, ..Self::EXACT }
    }

    /// A tolerance in units in the last place of f32.
    pub const fn ulps(ulps: f64) -> Self {
        Self { ulps, ..Self::EXACT }
    }

    /// How far from `expected` a number may be.
    pub fn around(self, expected: f64) -> f64 {
        self.absolute + self.relative * expected.abs() + self.ulps * ulp(expected)
    }

    /// An error in units of the tolerance: at most 1 passes. NaN and infinities must be expected exactly.
    fn error(self, actual: f64, expected: f64) -> f64 {
        if actual == expected || actual.is_nan() && expected.is_nan() {
            return 0.0;
        }
        let error = (actual - expected).abs() / self.around(expected);
        if error.is_nan() || expected.is_infinite() { f64::INFINITY } else { error }
    }
}

/// The distance of f32 neighbours at a value.
fn ulp(value: f64) -> f64 {
    let exponent = value.abs().max(f64::from(f32::MIN_POSITIVE)).log2().floor();
    (exponent - 23.0).exp2()
}

/// A value that is compared number by number.
pub trait Scalars {
    /// Its numbers in order.
    fn scalars(&self) -> Vec<f64>;
}

impl Scalars for f32 {
    fn scalars(&self) -> Vec<f64> {
        vec![f64::from(*self)]
    }
}

impl Scalars for f64 {
    fn scalars(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl<T: Scalars, const N: usize> Scalars for [T; N] {
    fn scalars(&self) -> Vec<f64> {
        self.iter().flat_map(T::scalars).collect()
    }
}

macro_rules! scalars_of_vectors {
    ($($vector:ty),*) => {
        $(impl Scalars for $vector {
            fn scalars(&self) -> Vec<f64> {
                self.to_array().scalars()
            }
        })*
    };
}

scalars_of_vectors!(glam::Vec2, glam::Vec3, glam::Vec4, glam::DVec2, glam::DVec3, glam::DVec4);

/// Compares each output with what `oracle` returns for its input, number by number. The oracle may return fewer numbers
/// than an output has; the rest is padding.
///
/// Returns the largest error in units of the tolerance, at most 1.
///
/// # Panics
/// If a number is off by more than the tolerance, or the numbers of outputs and inputs differ. The message counts the
/// wrong outputs and shows the first ones with their inputs.
pub fn assert_near<I: Debug, O: Scalars + Debug, E: Scalars>(
    what: &str,
    inputs: &[I],
    outputs: &[O],
    tolerance: Tolerance,
    oracle: impl Fn(&I) -> E,
) -> f64 {
    assert_eq!(inputs.len(), outputs.len(), "{what}: the numbers of inputs and outputs differ");
    let expected: Vec<_> = inputs.iter().map(|input| oracle(input).scalars()).collect();
    golden::write_expected(what, &expected, tolerance);
    let mut worst = 0.0f64;
    let mut n_failed = 0;
    let mut shown = String::new();
    for ((input, output), expected) in inputs.iter().zip(outputs).zip(&expected) {
        let actual = output.scalars();
        assert!(
            expected.len() <= actual.len(),
            "{what}: the oracle returns more numbers than an output has"
        );
        let errors = actual.iter().zip(expected).map(|(&a, &e)| tolerance.error(a, e));
        let error = errors.fold(0.0, f64::max);
        worst = worst.max(error);
        if error > 1.0 {
            n_failed += 1;
            if n_failed <= SHOWN {
                shown += &format!(
                    "\n  {input:?}: {output:?}, expected {expected:?}; off by {error:.3} tolerances"
                );
            }
        }
    }
    let n = inputs.len();
    assert!(
        n_failed == 0,
        "{what}: {n_failed} of {n} outputs are off by more than {tolerance:?}{shown}"
    );
    worst
}

/// Fails unless `holds` of each item. The message counts the others and shows the first ones with their places:
/// `indirect light: 2 of 64 are not black; 5: (0.1, 0, 0); 7: …`.
///
/// # Panics
/// If it does not hold of one, or there are no items.
pub fn assert_each<'a, T: Debug + 'a>(
    what: &str,
    items: impl IntoIterator<Item = &'a T>,
    expected: &str,
    holds: impl Fn(&T) -> bool,
) {
    let (mut n, mut n_failed, mut shown) = (0, 0, String::new());
    for (ix, item) in items.into_iter().enumerate() {
        n += 1;
        if !holds(item) {
            n_failed += 1;
            if n_failed <= SHOWN {
                shown += &format!("; {ix}: {item:?}");
            }
        }
    }
    assert!(n > 0, "{what}: there are none");
    assert!(n_failed == 0, "{what}: {n_failed} of {n} are not {expected}{shown}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_add_up() {
        assert_eq!(ulp(1.0), f64::from(f32::EPSILON));
        assert_eq!(ulp(-3.0), 2.0 * f64::from(f32::EPSILON));
        assert_eq!(ulp(0.0), f64::from(f32::from_bits(1)));
        let tolerance = Tolerance { absolute: 0.5, relative: 0.25, ulps: 2.0 };
        assert_eq!(tolerance.around(-2.0), 1.0 + 4.0 * f64::from(f32::EPSILON));
        assert_eq!(tolerance.error(f64::NAN, 1.0), f64::INFINITY);
        assert_eq!(tolerance.error(1.0, f64::INFINITY), f64::INFINITY);
        assert_eq!(tolerance.error(f64::NAN, f64::NAN), 0.0);
        assert_eq!(Tolerance::EXACT.error(2.0, 2.0), 0.0);
        assert_eq!(Tolerance::EXACT.error(2.0, 2.5), f64::INFINITY);
    }

    #[test]
    fn the_worst_error_comes_back() {
        let oracle = |&x: &f32| [f64::from(x)];
        let worst =
            assert_near("x", &[1.0, 2.0], &[1.25f32, 2.0], Tolerance::absolute(0.5), oracle);
        assert_eq!(worst, 0.5);
    }

    #[test]
    #[should_panic(expected = "x: 1 of 2 outputs are off")]
    fn an_error_fails() {
        assert_near("x", &[1.0, 2.0], &[1.0f32, f32::NAN], Tolerance::relative(0.5), |&x: &f64| x);
    }

    #[test]
    #[should_panic(expected = "numbers: 2 of 4 are not even; 1: 3; 3: 5")]
    fn each_item_is_checked() {
        assert_each("numbers", &[2, 3, 4, 5], "even", |n| n % 2 == 0);
    }

    #[test]
    #[should_panic(expected = "numbers: there are none")]
    fn nothing_is_not_enough() {
        assert_each("numbers", &[0i32; 0], "even", |n| n % 2 == 0);
    }
}
