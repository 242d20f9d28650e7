// SPDX-License-Identifier: MIT OR Apache-2.0
//! Runs WGSL functions over arrays of inputs on the GPU: the library's own, `lucerna::testing`.

#![allow(unused_imports)] // each test target takes what it needs

pub use lucerna::testing::{
    Estimate, Random, Tolerance, assert_each, assert_estimate, assert_estimates, assert_near,
    compose, gpu, map, map_with, normal_limit, ray_query_gpu, read, storage, submit, uniform,
};

/// How many bytes differ and where the first of them is, for the messages of tests.
pub fn differing_bytes(found: &[u8], expected: &[u8]) -> String {
    if found.len() != expected.len() {
        return format!("{} bytes, expected {}", found.len(), expected.len());
    }
    let differ = |ix: &usize| found[*ix] != expected[*ix];
    let n = (0..found.len()).filter(differ).count();
    let first = (0..found.len()).find(differ).map_or(String::new(), |ix| {
        format!(", the first is byte {ix}: {}, expected {}", found[ix], expected[ix])
    });
    format!("{n} of {} bytes differ{first}", found.len())
}

/// Maxima and minima that keep NaN, so that a comparison with a bound fails: those of the standard library and of glam
/// (all but the last component) leave it out.
pub trait KeepNan {
    fn max_nan(self, other: Self) -> Self;
    #[allow(dead_code)] // each test target takes what it needs
    fn min_nan(self, other: Self) -> Self;
}

macro_rules! keep_nan {
    ($($number:ty),*) => {
        $(impl KeepNan for $number {
            fn max_nan(self, other: Self) -> Self {
                if self.is_nan() || self > other { self } else { other }
            }

            fn min_nan(self, other: Self) -> Self {
                if self.is_nan() || self < other { self } else { other }
            }
        })*
    };
}

keep_nan!(f32, f64);

/// The largest magnitude of a vector's components; NaN if one is.
pub trait Largest {
    type Number;
    fn largest(self) -> Self::Number;
}

macro_rules! largest {
    ($($vector:ident: $number:ty),*) => {
        $(impl Largest for glam::$vector {
            type Number = $number;

            fn largest(self) -> $number {
                self.to_array().into_iter().map(<$number>::abs).fold(0.0, <$number>::max_nan)
            }
        })*
    };
}

largest!(Vec2: f32, Vec3: f32, Vec4: f32, DVec2: f64, DVec3: f64, DVec4: f64);
