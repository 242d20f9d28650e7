// SPDX-License-Identifier: MIT OR Apache-2.0
//! Relative luminance of linear Rec. 709 RGB.
//!
//! ITU-R BT.709-6; the row Y of IEC 61966-2-1's matrix.
#define_import_path lucerna::color::luminance

const LUMINANCE_WEIGHTS: vec3<f32> = vec3<f32>(0.2126, 0.7152, 0.0722);

/// The luminance of linear RGB, in RGB's units; white (1, 1, 1) has luminance 1. Any finite RGB.
fn luminance(rgb: vec3<f32>) -> f32 {
    return dot(rgb, LUMINANCE_WEIGHTS);
}
