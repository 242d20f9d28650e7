// SPDX-License-Identifier: MIT OR Apache-2.0
//! Windows against ringing: each band is multiplied by a factor that falls with l.
//!
//! P.-P. Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008, "Ringing". A window blurs the
//! function, keeps its mean (the factor of band 0 is 1), and removes overshoot and negative lobes
//! of small, bright lights.
#define_import_path lucerna::sh::window
#import lucerna::math::constants::PI

/// Hann: (1 + cos(πl/w))/2 for l < w, else 0. `width`: w > 0, in bands; larger blurs less.
fn sh_window_hann(l: u32, width: f32) -> f32 {
    let t = f32(l) / width;
    return select(0.0, 0.5 + 0.5 * cos(PI * t), t < 1.0);
}

/// Lanczos: sin(πl/w)/(πl/w) for l < w, else 0, and 1 for l = 0. `width`: w > 0, in bands; blurs
/// less than Hann's of the same width.
fn sh_window_lanczos(l: u32, width: f32) -> f32 {
    let t = f32(l) / width;
    // The quotient would be 0/0 for l = 0.
    let x = PI * max(t, 1e-3);
    return select(select(0.0, sin(x) / x, t < 1.0), 1.0, l == 0u);
}

/// 1/(1 + λ l²(l + 1)²), which minimises the squared error plus λ times the squared Laplacian.
/// `lambda`: λ ≥ 0; 0 changes nothing, larger blurs more.
fn sh_window_laplacian(l: u32, lambda: f32) -> f32 {
    let curvature = f32(l * (l + 1u));
    return 1.0 / (1.0 + lambda * curvature * curvature);
}

/// Coefficients of order 1 times the factors of bands 0 and 1.
fn sh1_window(coefficients: array<vec3<f32>, 4>, factors: vec2<f32>) -> array<vec3<f32>, 4> {
    var c = coefficients;
    c[0] *= factors.x;
    for (var ix = 1u; ix < 4u; ix++) {
        c[ix] *= factors.y;
    }
    return c;
}

/// Coefficients of order 2 times the factors of bands 0, 1 and 2.
fn sh2_window(coefficients: array<vec3<f32>, 9>, factors: vec3<f32>) -> array<vec3<f32>, 9> {
    var c = coefficients;
    c[0] *= factors.x;
    for (var ix = 1u; ix < 4u; ix++) {
        c[ix] *= factors.y;
    }
    for (var ix = 4u; ix < 9u; ix++) {
        c[ix] *= factors.z;
    }
    return c;
}
