// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much a picture differs from a reference: mean ratio, MSE, RMSE, PSNR, SSIM, CIE lightness, FLIP.
//!
//! [`compare`] takes two linear [`Picture`]s of the same size and returns a [`Comparison`], whose fields document the
//! definitions. They use two kinds of pixel values:
//!
//! * **linear**: the pictures' values without changes, so that energy and highlights matter;
//! * **display**: linear values clipped to 0..1 and encoded as sRGB, in 0..1, not rounded to bytes unless the field
//!   says so. If the interesting part of the pictures is far below or above 1, scale both by the same factor first;
//!   otherwise the display numbers say little.
//!
//! The arithmetic is in f64, except FLIP's, which is in f32.

mod flip;
mod ssim;

use std::fmt;

use glam::DVec3;

use crate::picture::{Picture, PictureError, srgb};

pub use flip::{PIXELS_PER_DEGREE, difference_picture};

/// The most pixels that are compared: 2²⁵, enough for 8K UHD. The comparison needs about 80 bytes for each.
pub const MAX_COMPARED_PIXELS: usize = 1 << 25;

/// Rec. 709 luminance of linear RGB (the weights of IEC 61966-2-1).
const LUMINANCE_WEIGHTS: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// How much a test picture differs from a reference picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Mean of the test picture's linear red, green and blue.
    pub mean_test: [f64; 3],
    /// Mean of the reference's linear red, green and blue.
    pub mean_reference: [f64; 3],
    /// `mean_test / mean_reference` by channel: 1 if the energy is right. If the reference's mean is 0, it is 1 if the
    /// test's is also 0, and otherwise ±∞.
    pub mean_ratio: [f64; 3],
    /// Mean of `(test − reference)²` over pixels and channels, linear.
    pub mse: f64,
    /// `√mse`, linear, in the unit of the pictures.
    pub rmse: f64,
    /// `rmse / |mean of the reference over pixels and channels|`. If that mean is 0, it is 0 if `rmse` is 0, and
    /// otherwise ∞.
    pub relative_rmse: f64,
    /// Peak signal to noise ratio of the display values, `−10·log₁₀(mean (test − reference)²)`, peak 1, in
    /// decibel; ∞ where they are equal.
    pub psnr_db: f64,
    /// Structural similarity of the display values: 1 where they are equal. Wang et al., "Image Quality
    /// Assessment: From Error Visibility to Structural Similarity", IEEE TIP 13(4), 2004, with its Gaussian
    /// window (11 × 11, σ = 1.5), K₁ = 0.01, K₂ = 0.03, dynamic range 1 and population covariance; the mean
    /// over the pixels whose window lies inside the picture (a border of 5 is left out), by channel, then
    /// over channels. The same as scikit-image's `structural_similarity(gaussian_weights=True, sigma=1.5,
    /// use_sample_covariance=False, data_range=1, channel_axis=2)`. None where a side is shorter than 11.
    pub ssim: Option<f64>,
    /// Mean of `|L*(test) − L*(reference)|`, 0..100: CIE 1976 lightness of the linear Rec. 709 luminance
    /// clipped to 0..1 (white is luminance 1).
    pub mean_lightness_error: f64,
    /// Mean of the LDR-FLIP error map, 0..1, of the display values rounded to bytes, at
    /// [`PIXELS_PER_DEGREE`]. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images",
    /// HPG 2020.
    pub mean_flip: f64,
}

impl Comparison {
    /// The fields under their names, as a JSON object. JSON has no infinity: an infinite number and a missing
    /// `ssim` become null.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        serde_json::json!({
            "width": self.width,
            "height": self.height,
            "mean_test": self.mean_test,
            "mean_reference": self.mean_reference,
            "mean_ratio": self.mean_ratio,
            "mse": self.mse,
            "rmse": self.rmse,
            "relative_rmse": self.relative_rmse,
            "psnr_db": self.psnr_db,
            "ssim": self.ssim,
            "mean_lightness_error": self.mean_lightness_error,
            "mean_flip": self.mean_flip,
        })
    }
}

impl From<&Comparison> for serde_json::Value {
    fn from(comparison: &Comparison) -> Self {
        comparison.to_json()
    }
}

/// Which of the two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The picture under test.
    Test,
    /// The picture that it should match.
    Reference,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Test => "test",
            Self::Reference => "reference",
        })
    }
}

/// Why two pictures cannot be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The sizes differ.
    #[error(
        "the test picture has {} x {} pixels and the reference {} x {}; compare pictures of the same size",
        test[0], test[1], reference[0], reference[1]
    )]
    SizeMismatch {
        /// Width and height of the test picture.
        test: [u32; 2],
        /// Width and height of the reference.
        reference: [u32; 2],
    },
    /// One of them is empty, incomplete, or holds NaN or infinity.
    #[error("the {side} picture cannot be compared: {source}")]
    Unusable {
        /// Which.
        side: Side,
        /// What is wrong, and where.
        source: PictureError,
    },
    /// More than [`MAX_COMPARED_PIXELS`].
    #[error(
        "pictures of {width} x {height} pixels are too large to compare (at most {MAX_COMPARED_PIXELS} pixels); compare parts of them"
    )]
    TooLarge {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
}

/// Compares a linear picture with a linear reference of the same size.
///
/// # Errors
/// The sizes differ, a picture is empty or has another number of pixels than its size says, a value is NaN or infinite,
/// or there are more than [`MAX_COMPARED_PIXELS`] pixels.
pub fn compare(test: &Picture, reference: &Picture) -> Result<Comparison, CompareError> {
    check(test, reference)?;
    let n_pixels = test.rgb.len() as f64;
    let width = test.width as usize;

    let mut linear = LinearSums::default();
    let mut display_squares = 0.0;
    let mut ssim = ssim::Ssim::new(width);
    for (test_row, reference_row) in
        test.rgb.chunks_exact(width).zip(reference.rgb.chunks_exact(width))
    {
        let mut display_rows = [Vec::with_capacity(width), Vec::with_capacity(width)];
        for (&t, &r) in test_row.iter().zip(reference_row) {
            let (t, r) = (t.as_dvec3(), r.as_dvec3());
            linear.add(t, r);
            let [t, r] = [t, r].map(display_from_linear);
            display_squares += (t - r).length_squared();
            display_rows[0].push(t);
            display_rows[1].push(r);
        }
        ssim.add_row(&display_rows[0], &display_rows[1]);
    }

    let mse = linear.squares / (3.0 * n_pixels);
    let rmse = mse.sqrt();
    let mean_test = linear.test / n_pixels;
    let mean_reference = linear.reference / n_pixels;
    Ok(Comparison {
        width: test.width,
        height: test.height,
        mean_test: mean_test.to_array(),
        mean_reference: mean_reference.to_array(),
        mean_ratio: std::array::from_fn(|c| ratio(mean_test[c], mean_reference[c])),
        mse,
        rmse,
        relative_rmse: if rmse == 0.0 {
            0.0
        } else {
            rmse / (mean_reference.element_sum() / 3.0).abs()
        },
        psnr_db: -10.0 * (display_squares / (3.0 * n_pixels)).log10(),
        ssim: ssim.mean(),
        mean_lightness_error: linear.lightness / n_pixels,
        mean_flip: flip::mean_error(test, reference),
    })
}

fn check(test: &Picture, reference: &Picture) -> Result<(), CompareError> {
    let sizes = [test, reference].map(|p| [p.width, p.height]);
    if sizes[0] != sizes[1] {
        return Err(CompareError::SizeMismatch { test: sizes[0], reference: sizes[1] });
    }
    for (side, picture) in [(Side::Test, test), (Side::Reference, reference)] {
        picture
            .check_size()
            .and_then(|()| picture.check_finite())
            .map_err(|source| CompareError::Unusable { side, source })?;
    }
    if test.rgb.len() > MAX_COMPARED_PIXELS {
        return Err(CompareError::TooLarge { width: test.width, height: test.height });
    }
    Ok(())
}

/// Sums over pixels of linear values.
#[derive(Default)]
struct LinearSums {
    test: DVec3,
    reference: DVec3,
    squares: f64,
    lightness: f64,
}

impl LinearSums {
    fn add(&mut self, test: DVec3, reference: DVec3) {
        self.test += test;
        self.reference += reference;
        self.squares += (test - reference).length_squared();
        self.lightness += (lightness(test) - lightness(reference)).abs();
    }
}

/// See [`Comparison::mean_ratio`].
fn ratio(test: f64, reference: f64) -> f64 {
    if test == 0.0 && reference == 0.0 {
        1.0
    } else if reference == 0.0 {
        f64::INFINITY.copysign(test)
    } else {
        test / reference
    }
}

/// Clipped to 0..1 and sRGB-encoded.
fn display_from_linear(rgb: DVec3) -> DVec3 {
    DVec3::from(rgb.clamp(DVec3::ZERO, DVec3::ONE).to_array().map(srgb::encoded_from_linear))
}

/// CIE 1976 lightness L*, 0..100, of linear RGB (CIE 15:2004, 8.2.1): `116·f(Y) − 16`.
fn lightness(rgb: DVec3) -> f64 {
    /// δ, where `f` changes from a cube root to a line: `f(Y) = Y / (3δ²) + 4/29` for `Y ≤ δ³`.
    const DELTA: f64 = 6.0 / 29.0;
    let y = rgb.dot(LUMINANCE_WEIGHTS).clamp(0.0, 1.0);
    let f = if y > DELTA.powi(3) { y.cbrt() } else { y / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    116.0 * f - 16.0
}
