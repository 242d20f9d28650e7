// SPDX-License-Identifier: MIT OR Apache-2.0
//! Image files: linear pictures read from PNG, JPEG, Radiance HDR and OpenEXR, and written to PNG,
//! Radiance HDR and OpenEXR.
//!
//! A [`Picture`] holds linear values with Rec. 709 primaries, whatever its file held: 8- and 16-bit
//! files are decoded from sRGB ([`srgb`]), HDR and EXR hold linear values already. Colour profiles
//! and Exif orientation are not applied. Alpha is ignored.
//!
//! Radiance HDR is always there; PNG, JPEG and OpenEXR each have a feature, `png`, `jpeg` and `exr`. A file of a format that
//! was not built in gives [`PictureError::NotBuiltIn`].
//!
//! Files are hostile until checked: a file is read up to [`MAX_FILE_BYTES`], a picture up to
//! [`MAX_PIXELS`], and each failure is a [`PictureError`] that names the file.

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

/// The longest file that is read: 1 GiB, which holds [`MAX_PIXELS`] pixels of four uncompressed f32.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Linear RGB pixels, Rec. 709 primaries, scene-referred (unexposed) unless the maker says otherwise.
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
    /// Reads a PNG, JPEG, Radiance HDR or OpenEXR file into linear values. The first bytes decide on
    /// the format, not the name.
    ///
    /// * PNG and JPEG, 8 or 16 bits: decoded from sRGB by IEC 61966-2-1; grey becomes RGB.
    /// * Radiance HDR: value `= mantissa · 2^(exponent − 136)`, divided by the header's `EXPOSURE`
    ///   and `COLORCORR` where they stand (so the values are what was recorded, as Radiance's own
    ///   tools read them); `-Y +X` orientation only.
    /// * OpenEXR: the first flat layer with channels `R`, `G`, `B`, or else a lone luminance channel
    ///   `Y`. The picture is the display window; what the data window leaves open is black.
    ///
    /// Values are not judged: an EXR may hold NaN, infinity and negative values. See
    /// [`Picture::check_finite`].
    ///
    /// # Errors
    /// The file cannot be read, is none of these formats, is cut short or damaged, is longer than
    /// [`MAX_FILE_BYTES`], or has no pixel or more than [`MAX_PIXELS`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, PictureError> {
        read::read(path.as_ref())
    }

    /// Writes the picture in the format that the name's ending asks for, whole or not at all (see
    /// [`write_whole_file`]).
    ///
    /// * `.exr`: linear f32, unexposed, bit for bit (also NaN and infinity); ZIP compression.
    /// * `.hdr`: linear RGBE, unexposed. Each channel is off by at most 1/256 of the pixel's largest
    ///   one. RGBE has no sign and ends at 255 · 2¹¹⁹: negative values become 0, larger ones that.
    /// * `.png`: 8-bit `sRGB(2^EV · value)`, tone mapped if `png` says so, clipped to 0..1 and
    ///   rounded to nearest.
    ///
    /// `png` concerns PNG only.
    ///
    /// # Errors
    /// The ending is another one; the pixels are not `width · height` or none; a value is NaN or
    /// infinite and the format is not EXR; the exposure is not finite; or the file cannot be written.
    pub fn write(&self, path: impl AsRef<Path>, png: &PngOptions) -> Result<(), PictureError> {
        write::write(self, path.as_ref(), png)
    }

    /// Says whether every value is finite, and if not, which pixel is the first that holds one that is not.
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

    /// Says whether the picture has at least one pixel and as many as its size promises.
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
