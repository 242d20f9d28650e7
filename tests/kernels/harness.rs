// SPDX-License-Identifier: MIT OR Apache-2.0
//! Runs WGSL functions over arrays of inputs on the GPU: the library's own, `lucerna::testing`.

#![allow(unused_imports)] // each test target takes what it needs

pub use lucerna::testing::{
    Estimate, Random, Tolerance, assert_each, assert_estimate, assert_estimates, assert_near,
    compose, gpu, map, map_with, normal_limit, ray_query_gpu, read, storage, submit, uniform,
};
