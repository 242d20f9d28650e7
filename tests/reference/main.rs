// SPDX-License-Identifier: MIT OR Apache-2.0
//! The path tracer against closed forms, quadrature in f64, and another renderer's pictures.

mod channels;
mod degenerate;
mod emitters;
mod energy;
mod furnace;
#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
mod independent;
mod loops;
mod normal_maps;
mod punctual;
mod repeatable;
mod sky;
mod support;
#[path = "../kernels/texture_oracle.rs"]
mod texture_oracle;
mod textures;
