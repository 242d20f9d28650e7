// SPDX-License-Identifier: MIT OR Apache-2.0
//! Decoding of images, with limits.

#[cfg(any(feature = "jpeg", feature = "png"))]
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use super::Image;
use super::error::ImageError;
use super::limits::{Budget, LoadLimits};

/// The largest ratio of DEFLATE: 258 bytes from 2 bits.
const PNG_MAX_RATIO: u64 = 1032;
/// A baseline JPEG needs at least 2 bits for a block of 64 pixels; the additional factor of 4 is
/// for components that are sampled more coarsely than luma.
const JPEG_MAX_PIXELS_PER_BYTE: u64 = 64 * 8 / 2 * 4;
/// Memory for headers, palettes and text, in addition to the pixels.
const DECODER_SLACK: u64 = 1 << 24;

/// Decodes PNG or JPEG to 8-bit RGBA (16-bit PNG is rounded to 8). No memory is allocated for the
/// pixels before the size in the header has passed the limits and is plausible for the file's
/// length.
pub(super) fn decode(
    name: String,
    bytes: &[u8],
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Image, ImageError> {
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        #[cfg(feature = "png")]
        return decode_as(ImageFormat::Png, name, bytes, limits, budget);
        #[cfg(not(feature = "png"))]
        return Err(ImageError::NotBuiltIn { format: "PNG", feature: "png" });
    }
    if bytes.starts_with(b"\xff\xd8\xff") {
        #[cfg(feature = "jpeg")]
        return decode_as(ImageFormat::Jpeg, name, bytes, limits, budget);
        #[cfg(not(feature = "jpeg"))]
        return Err(ImageError::NotBuiltIn { format: "JPEG", feature: "jpeg" });
    }
    Err(ImageError::Format)
}

#[cfg(any(feature = "jpeg", feature = "png"))]
fn decode_as(
    format: ImageFormat,
    name: String,
    bytes: &[u8],
    limits: &LoadLimits,
    budget: &mut Budget,
) -> Result<Image, ImageError> {
    let decode = |e: image::ImageError| ImageError::Decode(e.to_string());

    let mut reader = ImageReader::with_format(std::io::Cursor::new(bytes), format);
    let mut decoder_limits = Limits::no_limits();
    decoder_limits.max_alloc = Some(
        limits
            .max_image_pixels
            .saturating_mul(8)
            .min(budget.left().saturating_mul(2))
            .saturating_add(DECODER_SLACK),
    );
    reader.limits(decoder_limits);
    let decoder = reader.into_decoder().map_err(decode)?;
    let (width, height) = decoder.dimensions();
    let n_pixels = u64::from(width) * u64::from(height);
    if n_pixels == 0 {
        return Err(ImageError::Empty);
    }
    if n_pixels > limits.max_image_pixels {
        return Err(ImageError::TooLarge { width, height, limit: limits.max_image_pixels });
    }
    let n_bytes = bytes.len() as u64;
    let plausible = match format {
        ImageFormat::Png => {
            let bits = u64::from(decoder.original_color_type().bits_per_pixel()).max(1);
            n_pixels / 8 * bits <= n_bytes * PNG_MAX_RATIO
        }
        _ => n_pixels <= n_bytes * JPEG_MAX_PIXELS_PER_BYTE,
    };
    if !plausible {
        return Err(ImageError::Lies { width, height, bytes: n_bytes });
    }
    let left = budget.left();
    budget.take(n_pixels, 4, "image").map_err(|_| ImageError::NoBudget { width, height, left })?;

    let pixels = DynamicImage::from_decoder(decoder).map_err(decode)?;
    let rgba: Vec<[u8; 4]> = pixels.into_rgba8().pixels().map(|pixel| pixel.0).collect();
    Ok(Image { name, width, height, rgba })
}

/// One white texel, for an image that cannot be read.
pub(super) fn white(name: String) -> Image {
    Image { name, width: 1, height: 1, rgba: vec![[255; 4]] }
}
