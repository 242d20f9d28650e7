// SPDX-License-Identifier: MIT OR Apache-2.0
//! FLIP, computed by NVIDIA's own code (crate `nv-flip`).

use glam::Vec3;
use nv_flip::{FlipImageFloat, FlipImageRgb8};

use super::{CompareError, check};
use crate::picture::{Picture, srgb};

/// Pixels per degree of the visual field, FLIP's default: 0.7 m from a screen 0.7 m wide with 3840 pixels.
pub const PIXELS_PER_DEGREE: f32 = 67.0;

/// A picture of where two pictures differ: FLIP's error of each pixel in the magma colour map, from black
/// (no difference) through purple and orange to pale yellow (the largest, 1).
///
/// The values are linear, as in any picture; written as PNG without exposure or tone map, they become the bytes of the
/// colour map.
///
/// # Errors
/// As [`compare`](super::compare).
pub fn difference_picture(test: &Picture, reference: &Picture) -> Result<Picture, CompareError> {
    check(test, reference)?;
    let colors = error_map(test, reference).apply_color_lut(&nv_flip::magma_lut()).to_vec();
    let rgb = colors
        .as_chunks::<3>()
        .0
        .iter()
        .map(|&c| Vec3::from(c.map(srgb::linear_from_byte)))
        .collect();
    Ok(Picture { width: test.width, height: test.height, rgb })
}

/// The pictures must have been checked.
pub(super) fn mean_error(test: &Picture, reference: &Picture) -> f64 {
    let errors = error_map(test, reference).to_vec();
    errors.iter().copied().map(f64::from).sum::<f64>() / errors.len() as f64
}

fn error_map(test: &Picture, reference: &Picture) -> FlipImageFloat {
    nv_flip::flip(flip_image(reference), flip_image(test), PIXELS_PER_DEGREE)
}

fn flip_image(picture: &Picture) -> FlipImageRgb8 {
    let bytes: Vec<u8> = picture
        .rgb
        .iter()
        .flat_map(|rgb| rgb.to_array().map(|v| srgb::byte_from_linear(v.into())))
        .collect();
    FlipImageRgb8::with_data(picture.width, picture.height, &bytes)
}
