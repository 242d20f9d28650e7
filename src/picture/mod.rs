// SPDX-License-Identifier: MIT OR Apache-2.0
//! Image files: linear pictures read from PNG, JPEG, Radiance HDR and OpenEXR, and written to PNG,
//! Radiance HDR and OpenEXR.
//!
//! A [`Picture`] always holds linear values with Rec. 709 primaries: 8- and 16-bit files are decoded from sRGB
//! ([`srgb`]); HDR and EXR files already hold linear values. Colour profiles and Exif orientation are not applied.
//! Alpha is ignored.
//!
//! Radiance HDR is always available; PNG, JPEG and OpenEXR need the features `png`, `jpeg` and `exr`. A file of a
//! format that was not built in gives [`PictureError::NotBuiltIn`].
//!
//! Files are not trusted: a file may have up to [`MAX_FILE_BYTES`], a picture up to [`MAX_PIXELS`], and each failure is
//! a [`PictureError`] that names the file.

mod error;
#[cfg(feature = "exr")]
mod openexr;
mod radiance;
mod read;
pub mod srgb;
pub mod tone_map;
mod whole_file;
mod write;

use std::path::Path;

use glam::Vec3;

pub use error::{Channel, Format, PictureError};
pub use tone_map::ToneMap;
pub use whole_file::{check_whole_file, write_whole_file};
pub use write::PngOptions;

/// The most pixels a picture may have: 2²⁶, as in 8192 × 8192 or an 11 585 × 5792 sky (768 MiB in memory).
pub const MAX_PIXELS: u64 = 1 << 26;

/// The longest file that is read: 1 GiB, enough for [`MAX_PIXELS`] pixels of four uncompressed f32.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Linear RGB pixels, Rec. 709 primaries, scene-referred (unexposed) unless documented otherwise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// `width · height` pixels, row by row from the top, left to right.
    pub rgb: Vec<Vec3>,
}

impl Picture {
    /// Reads a PNG, JPEG, Radiance HDR or OpenEXR file into linear values. The first bytes decide the format, not the
    /// name.
    ///
    /// * PNG and JPEG, 8 or 16 bits: decoded from sRGB by IEC 61966-2-1; grey becomes RGB.
    /// * Radiance HDR: value `= mantissa · 2^(exponent − 136)`, divided by the header's `EXPOSURE` and `COLORCORR`, if
    ///   it has them (so that the values are the recorded ones, as in Radiance's own tools); only the orientation `-Y
    ///   +X`.
    /// * OpenEXR: the first flat layer with channels `R`, `G`, `B`, or else a lone luminance channel `Y`. The picture
    ///   is the display window; what the data window does not cover is black.
    ///
    /// Values are not checked: an EXR may hold NaN, infinity and negative values. See [`Picture::check_finite`].
    ///
    /// # Errors
    /// The file cannot be read, has none of these formats, is truncated or damaged, is longer than [`MAX_FILE_BYTES`],
    /// or has no pixels or more than [`MAX_PIXELS`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, PictureError> {
        read::read(path.as_ref())
    }

    /// Writes the picture in the format of the name's extension, completely or not at all (see [`write_whole_file`]).
    ///
    /// * `.exr`: linear f32, unexposed, bit for bit (also NaN and infinity); ZIP compression.
    /// * `.hdr`: linear RGBE, unexposed. Each channel is off by at most 1/256 of the pixel's largest one. RGBE has no
    ///   sign and a largest value of 255 · 2¹¹⁹: negative values become 0, larger ones this value.
    /// * `.png`: 8-bit `sRGB(2^EV · value)`, tone mapped if `png` says so, clipped to 0..1 and
    ///   rounded to nearest.
    ///
    /// `png` only affects PNG.
    ///
    /// # Errors
    /// The extension is another one; there are no pixels or not `width · height` of them; a value is NaN or infinite
    /// and the format is not EXR; the exposure is not finite; or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, png: &PngOptions) -> Result<(), PictureError> {
        write::write(self, path.as_ref(), png)
    }

    /// Checks that every value is finite. If not, the error names the first pixel with a value that is not.
    ///
    /// # Errors
    /// [`PictureError::NotFinite`] with column, row (from the top, from 0), channel and value.
    pub fn check_finite(&self) -> Result<(), PictureError> {
        let Some(pixel_ix) = self.rgb.iter().position(|rgb| !rgb.is_finite()) else {
            return Ok(());
        };
        let rgb = self.rgb[pixel_ix];
        let channel = Channel::ALL
            .into_iter()
            .find(|&c| !rgb[c as usize].is_finite())
            .unwrap_or(Channel::Red);
        let width = (self.width as usize).max(1);
        Err(PictureError::NotFinite {
            x: pixel_ix % width,
            y: pixel_ix / width,
            channel,
            value: rgb[channel as usize],
        })
    }

    /// Checks that the picture has at least one pixel, and as many as its size says.
    ///
    /// # Errors
    /// [`PictureError::WrongLength`] or [`PictureError::Empty`].
    pub fn check_size(&self) -> Result<(), PictureError> {
        if self.width == 0 || self.height == 0 {
            return Err(PictureError::Empty { width: self.width, height: self.height });
        }
        if self.rgb.len() as u64 != u64::from(self.width) * u64::from(self.height) {
            return Err(PictureError::WrongLength {
                width: self.width,
                height: self.height,
                n_pixels: self.rgb.len(),
            });
        }
        Ok(())
    }
}
