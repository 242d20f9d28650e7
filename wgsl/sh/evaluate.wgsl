// SPDX-License-Identifier: MIT OR Apache-2.0
//! Values of functions given by SH coefficients: f(ω) = Σ cⱼ Yⱼ(ω).
//!
//! A truncated series rings: it may be negative where the function is not. Clamp if that matters,
//! or window the coefficients (`lucerna::sh::window`).
#define_import_path lucerna::sh::evaluate
#import lucerna::sh::basis::{sh1_basis, sh2_basis, sh_basis}

/// Σ cⱼ Yⱼ of order 1 at a unit direction, in the coefficients' units.
fn sh1_evaluate(coefficients: array<vec3<f32>, 4>, direction: vec3<f32>) -> vec3<f32> {
    var c = coefficients;
    var y = sh1_basis(direction);
    return c[0] * y[0] + c[1] * y[1] + c[2] * y[2] + c[3] * y[3];
}

/// Σ cⱼ Yⱼ of order 2 at a unit direction, in the coefficients' units.
fn sh2_evaluate(coefficients: array<vec3<f32>, 9>, direction: vec3<f32>) -> vec3<f32> {
    var c = coefficients;
    var y = sh2_basis(direction);
    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < 9u; ix++) {
        sum += c[ix] * y[ix];
    }
    return sum;
}

/// Σ cⱼ Yⱼ of order 7 at a unit direction, in the coefficients' units. By pointer, because 64
/// colours are expensive to copy (and slow to compile); sum coefficients in storage buffers
/// directly, over `sh_basis`.
fn sh_evaluate(
    coefficients: ptr<function, array<vec3<f32>, 64>>,
    direction: vec3<f32>,
) -> vec3<f32> {
    var y = sh_basis(direction);
    var sum = vec3<f32>(0.0);
    for (var ix = 0u; ix < 64u; ix++) {
        sum += (*coefficients)[ix] * y[ix];
    }
    return sum;
}
