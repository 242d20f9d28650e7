// SPDX-License-Identifier: MIT OR Apache-2.0
//! Convolution with a lobe exp(κ(ω·d − 1)), normalised: radiance as a glossy surface reflects it.
//!
//! The lobe is von Mises' and Fisher's (a normalised spherical Gaussian of sharpness κ). Its factors obey the recurrence of modified spherical
//! Bessel functions: a₀ = 1, a₁ = coth κ − 1/κ, a(l + 1) = a(l − 1) − (2l + 1)/κ · a(l).
#define_import_path lucerna::sh::lobe

/// From here on the recurrence is exact to 1e-3; smaller sharpness is read as this.
const MIN_LOBE_SHARPNESS: f32 = 0.5;

/// By what bands 0 to 4 are multiplied. `sharpness`: κ, at least MIN_LOBE_SHARPNESS.
fn sh_lobe_factors(sharpness: f32) -> array<f32, 5> {
    let k = max(sharpness, MIN_LOBE_SHARPNESS);
    let e = exp(-2.0 * k);
    var a: array<f32, 5>;
    a[0] = 1.0;
    a[1] = (1.0 + e) / (1.0 - e) - 1.0 / k;
    for (var l = 1u; l < 4u; l++) {
        a[l + 1u] = max(a[l - 1u] - f32(2u * l + 1u) / k * a[l], 0.0);
    }
    return a;
}

/// The lobe's mean of a function that is 1 above a plane and 0 below it, from bands 0 to `last` ≤ 4. `cosine`: of the lobe to the plane's normal.
/// The step's zonal series is 1/2 + 3/4 P₁ − 7/16 P₃ + …
fn sh_lobe_above(factors: array<f32, 5>, cosine: f32, last: u32) -> f32 {
    var a = factors;
    var sum = 0.5 * a[0];
    if last >= 1u {
        sum += 0.75 * a[1] * cosine;
    }
    if last >= 3u {
        sum -= 0.4375 * a[3] * cosine * (2.5 * cosine * cosine - 1.5);
    }
    return sum;
}
