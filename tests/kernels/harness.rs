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
