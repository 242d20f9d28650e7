// SPDX-License-Identifier: MIT OR Apache-2.0
//! The frame that techniques share: its G-buffer against rays in f64, its direct light against closed
//! forms and the path tracer.

mod direct;
mod gbuffer;
mod guards;
#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
mod recording;
mod refused;
mod scales;
mod shadows;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;
mod whole;
