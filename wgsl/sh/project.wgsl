// SPDX-License-Identifier: MIT OR Apache-2.0
//! Projection of a function onto SH: cⱼ = ∫ f Yⱼ dω, sample by sample.
//!
//! Monte Carlo: cⱼ ≈ Σ Yⱼ(ωₖ) · f(ωₖ) · wₖ with weight w = 1/(N · pdf), the pdf with respect to
//! solid angle: 4π/N for N samples uniform over the sphere ([`sh_uniform_weight`]). The caller
//! multiplies value and weight.
//!
//!     var radiance: array<vec3<f32>, 9>;
//!     for … { sh2_accumulate(&radiance, direction, weight * value); }
//!
//! Nothing here rejects NaN; `lucerna::math::float` can.
#define_import_path lucerna::sh::project
#import lucerna::sh::basis::{sh1_basis, sh2_basis, sh_basis}

const FOUR_PI: f32 = 12.5663706143592;

/// Weight (sr) of each of `n_samples` (at least 1) directions uniform over the sphere: 4π/N.
fn sh_uniform_weight(n_samples: u32) -> f32 {
    return FOUR_PI / f32(n_samples);
}

/// Adds a sample to the 4 coefficients of order 1. `direction`: unit; `weighted`: value × weight.
fn sh1_accumulate(
    coefficients: ptr<function, array<vec3<f32>, 4>>,
    direction: vec3<f32>,
    weighted: vec3<f32>,
) {
    var y = sh1_basis(direction);
    for (var ix = 0u; ix < 4u; ix++) {
        (*coefficients)[ix] += weighted * y[ix];
    }
}

/// Adds a sample to the 9 coefficients of order 2. `direction`: unit; `weighted`: value × weight.
fn sh2_accumulate(
    coefficients: ptr<function, array<vec3<f32>, 9>>,
    direction: vec3<f32>,
    weighted: vec3<f32>,
) {
    var y = sh2_basis(direction);
    for (var ix = 0u; ix < 9u; ix++) {
        (*coefficients)[ix] += weighted * y[ix];
    }
}

/// Adds a sample to the 64 coefficients of order 7. `direction`: unit; `weighted`: value × weight.
fn sh_accumulate(
    coefficients: ptr<function, array<vec3<f32>, 64>>,
    direction: vec3<f32>,
    weighted: vec3<f32>,
) {
    var y = sh_basis(direction);
    for (var ix = 0u; ix < 64u; ix++) {
        (*coefficients)[ix] += weighted * y[ix];
    }
}
