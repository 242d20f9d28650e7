// SPDX-License-Identifier: MIT OR Apache-2.0
//! CIE 1976 L*a*b* of linear Rec. 709 RGB, white D65: a space in which distances are about as
//! large as they look.
//!
//! ISO/CIE 11664-4:2019. L* runs from 0 (black) to 100 (white); a* from green to red and b* from
//! blue to yellow, each within about ±110 for colours of Rec. 709.
#define_import_path lucerna::color::lab
#import lucerna::color::luminance::luminance
#import lucerna::color::xyz::{WHITE_XYZ, linear_from_xyz, xyz_from_linear}

/// (6/29)³: below it the curve is a line. f(LAB_THRESHOLD) = 6/29.
const LAB_THRESHOLD: f32 = 0.00885645167904;
const LAB_KNEE: f32 = 0.206896551724138;
/// The line's slope, (29/6)²/3, and offset, 4/29.
const LAB_SLOPE: f32 = 7.78703703703704;
const LAB_OFFSET: f32 = 0.137931034482759;

/// L*a*b* (L*, a*, b*) of linear RGB; white (1, 1, 1) gives (100, 0, 0).
///
/// Any finite RGB; above white L* continues beyond 100, below black along its line. Errors below
/// 2e-4 in L*, 1.5e-3 in a* and 6e-4 in b* over [0, 1]³.
fn lab_from_linear(rgb: vec3<f32>) -> vec3<f32> {
    let f = lab_curve(xyz_from_linear(rgb) / WHITE_XYZ);
    return vec3<f32>(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z));
}

/// L* alone of linear RGB, as [`lab_from_linear`].
fn lightness(rgb: vec3<f32>) -> f32 {
    return 116.0 * lab_curve(vec3<f32>(luminance(rgb))).x - 16.0;
}

/// Linear RGB of L*a*b*, the inverse of [`lab_from_linear`]; outside [0, 1] where the colour lies
/// outside the gamut. Errors below 1e-5 in the gamut.
fn linear_from_lab(lab: vec3<f32>) -> vec3<f32> {
    let y = (lab.x + 16.0) / 116.0;
    let f = vec3<f32>(y + lab.y / 500.0, y, y - lab.z / 200.0);
    let line = (f - LAB_OFFSET) / LAB_SLOPE;
    return linear_from_xyz(WHITE_XYZ * select(line, f * f * f, f > vec3<f32>(LAB_KNEE)));
}

/// Cube root, and a line near zero.
fn lab_curve(t: vec3<f32>) -> vec3<f32> {
    let root = pow(max(t, vec3<f32>(LAB_THRESHOLD)), vec3<f32>(1.0 / 3.0));
    return select(t * LAB_SLOPE + LAB_OFFSET, root, t > vec3<f32>(LAB_THRESHOLD));
}
