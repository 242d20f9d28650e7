// SPDX-License-Identifier: MIT OR Apache-2.0
//! Convolution with the clamped cosine lobe: irradiance of distant radiance.
//!
//! R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps",
//! SIGGRAPH 2001: E(n) = ∫ L(ω) max(0, n·ω) dω = Σ A(l) c(l, m) Y(l, m)(n).
//! Order 2 holds 99 % of the lobe's energy. The worst case is a single distant light, where order 2 is
//! off by up to 9.4 % of the irradiance that faces the light (at grazing incidence), order 1 by 25 %;
//! both may be negative (order 1 by those 25 %).
#define_import_path lucerna::sh::convolve
#import lucerna::sh::basis::{SH_BAND_ONE, SH_CONSTANT, sh2_basis, sh_band}

/// A(l), the cosine lobe's factors (sr): π, 2π/3, π/4, 0, −π/24, 0, π/64, 0.
const SH_COSINE_LOBE: array<f32, 8> = array<f32, 8>(
    3.14159265358979,
    2.09439510239320,
    0.785398163397448,
    0.0,
    -0.130899693899575,
    0.0,
    0.0490873852123405,
    0.0,
);

/// A(l) of band l ≤ 7 (sr), which turns a coefficient of radiance into one of irradiance.
fn sh_cosine_factor(l: u32) -> f32 {
    var factors = SH_COSINE_LOBE;
    return factors[l];
}

/// Irradiance (W·m⁻²) on a surface with unit normal, of radiance (W·sr⁻¹·m⁻²) of order 1.
/// Includes the cosine; times albedo/π it is the radiance that leaves a Lambert surface.
fn sh1_irradiance(radiance: array<vec3<f32>, 4>, normal: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    let n = (SH_COSINE_LOBE[1] * SH_BAND_ONE) * normal;
    return (SH_COSINE_LOBE[0] * SH_CONSTANT) * c[0] + n.y * c[1] + n.z * c[2] + n.x * c[3];
}

/// Irradiance (W·m⁻²) on a surface with unit normal, of radiance (W·sr⁻¹·m⁻²) of order 2.
/// Includes the cosine; times albedo/π it is the radiance that leaves a Lambert surface.
fn sh2_irradiance(radiance: array<vec3<f32>, 9>, normal: vec3<f32>) -> vec3<f32> {
    var c = radiance;
    var y = sh2_basis(normal);
    let constant = c[0] * y[0];
    let linear = c[1] * y[1] + c[2] * y[2] + c[3] * y[3];
    let quadratic = c[4] * y[4] + c[5] * y[5] + c[6] * y[6] + c[7] * y[7] + c[8] * y[8];
    return SH_COSINE_LOBE[0] * constant
        + SH_COSINE_LOBE[1] * linear
        + SH_COSINE_LOBE[2] * quadratic;
}

/// Coefficients of irradiance from those of radiance, order 1: store these in a probe, so that a lookup costs only an
/// evaluation.
fn sh1_convolve_cosine(radiance: array<vec3<f32>, 4>) -> array<vec3<f32>, 4> {
    var c = radiance;
    for (var ix = 0u; ix < 4u; ix++) {
        c[ix] *= sh_cosine_factor(sh_band(ix));
    }
    return c;
}

/// Coefficients of irradiance from those of radiance, order 2.
fn sh2_convolve_cosine(radiance: array<vec3<f32>, 9>) -> array<vec3<f32>, 9> {
    var c = radiance;
    for (var ix = 0u; ix < 9u; ix++) {
        c[ix] *= sh_cosine_factor(sh_band(ix));
    }
    return c;
}

/// Coefficients of irradiance from those of radiance, order 7, in place (64 colours are expensive to copy).
fn sh_convolve_cosine(coefficients: ptr<function, array<vec3<f32>, 64>>) {
    for (var ix = 0u; ix < 64u; ix++) {
        (*coefficients)[ix] *= sh_cosine_factor(sh_band(ix));
    }
}
