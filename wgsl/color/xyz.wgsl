// SPDX-License-Identifier: MIT OR Apache-2.0
//! CIE 1931 XYZ from linear Rec. 709 RGB, and back.
//!
//! IEC 61966-2-1:1999: primaries of Rec. 709, white D65, the matrix rounded to four digits as
//! the standard prints it, so that white is the sum of its columns, exactly. Y = 1 for white.
#define_import_path lucerna::color::xyz
#import lucerna::color::luminance::LUMINANCE_WEIGHTS

/// D65 as in the standard: XYZ of RGB (1, 1, 1).
const WHITE_XYZ: vec3<f32> = vec3<f32>(0.9505, 1.0, 1.089);

/// XYZ of linear RGB; any finite numbers, because the map is linear.
fn xyz_from_linear(rgb: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(rgb, vec3<f32>(0.4124, 0.3576, 0.1805)),
        dot(rgb, LUMINANCE_WEIGHTS),
        dot(rgb, vec3<f32>(0.0193, 0.1192, 0.9505)),
    );
}

/// Linear RGB of XYZ: the inverse matrix of [`xyz_from_linear`]. Colours outside the gamut of
/// Rec. 709 have negative components.
fn linear_from_xyz(xyz: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(xyz, vec3<f32>(3.240625477, -1.537207972, -0.498628599)),
        dot(xyz, vec3<f32>(-0.968930715, 1.875756061, 0.041517524)),
        dot(xyz, vec3<f32>(0.055710120, -0.204021051, 1.056995942)),
    );
}
