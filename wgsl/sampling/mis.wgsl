// SPDX-License-Identifier: MIT OR Apache-2.0
//! Multiple importance sampling of two strategies with one sample each.
//!
//! E. Veach, L. Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", 1995.
#define_import_path lucerna::sampling::mis

/// Balance heuristic (eq. 14): the weight of a sample of density `pdf`, for which the other strategy's density is
/// `other_pdf`. Both ≥ 0 in the same measure, their sum up to 2¹²⁶ (GPUs need not divide by more); 0 if both are 0.
fn balance_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    let sum = pdf + other_pdf;
    return select(0.0, pdf / sum, sum > 0.0);
}

/// Power heuristic with exponent 2 (eq. 15). Densities up to f32's maximum do not overflow.
fn power_heuristic(pdf: f32, other_pdf: f32) -> f32 {
    let largest = max(pdf, other_pdf);
    if !(largest > 0.0) {
        return 0.0;
    }
    // (GPUs need not divide by more than 2¹²⁶.)
    let scale = select(1.0, 0x1p-64f, largest > 1e18);
    let shares = vec2<f32>(pdf, other_pdf) * scale / (largest * scale);
    let squares = shares * shares;
    return squares.x / (squares.x + squares.y);
}

/// The weight of a light sample against other ways to find the light, in [0, 1].
///
/// `light_pdf`: density of the light sample, `other_pdf`: that of the other way, each times its number of samples
/// [sr⁻¹]. A light without extent (`light_pdf` 0) is found only by light samples.
fn next_event_weight(light_pdf: f32, other_pdf: f32) -> f32 {
    return select(power_heuristic(light_pdf, other_pdf), 1.0, light_pdf == 0.0);
}

/// The solid angle that one sample of a light represents [sr]; 0 for lights without extent (`pdf` 0). `pdf`: times the
/// number of samples.
fn solid_angle_of_sample(pdf: f32) -> f32 {
    return select(0.0, 1.0 / pdf, pdf > 0.0);
}
