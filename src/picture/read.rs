// SPDX-License-Identifier: MIT OR Apache-2.0
//! Reads pictures from files.

use std::fs::File;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

#[cfg(any(feature = "jpeg", feature = "png"))]
use glam::Vec3;
#[cfg(any(feature = "jpeg", feature = "png"))]
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

#[cfg(feature = "exr")]
use super::openexr;
#[cfg(any(feature = "jpeg", feature = "png"))]
use super::srgb::{LINEAR_FROM_BYTE, LINEAR_FROM_WORD};
use super::{Format, MAX_FILE_BYTES, MAX_PIXELS, Picture, PictureError, radiance};

/// Memory that PNG and JPEG decoders may use in addition to the file: twice the 8 bytes per pixel of 16-bit RGBA.
#[cfg(any(feature = "jpeg", feature = "png"))]
const MAX_DECODER_BYTES: u64 = MAX_PIXELS * 16;

/// Why a file's bytes are not a picture; [`read`] adds the path.
pub(super) enum DecodeError {
    /// Damaged or not supported; the text says what and what to do.
    Reason(String),
    /// Its format's feature is off.
    #[cfg(not(all(feature = "exr", feature = "jpeg", feature = "png")))]
    NotBuiltIn,
    /// Too many pixels, or none.
    Size(u64, u64),
    /// An EXR without R, G, B or Y; the channels it has.
    #[cfg(feature = "exr")]
    Channels(String),
}

impl DecodeError {
    pub(super) fn reason(text: impl ToString) -> Self {
        Self::Reason(text.to_string())
    }
}

pub(super) fn read(path: &Path) -> Result<Picture, PictureError> {
    let bytes = read_file(path)?;
    let format = format_from_content(&bytes)
        .ok_or_else(|| PictureError::UnknownFormat { path: path.to_owned() })?;
    // External decoders should not panic, but a file that makes one panic must not end the process.
    let decoded = catch_unwind(AssertUnwindSafe(|| match format {
        #[cfg(feature = "png")]
        Format::Png => decode_display(&bytes, ImageFormat::Png),
        #[cfg(feature = "jpeg")]
        Format::Jpeg => {
            check_jpeg_is_whole(&bytes).and_then(|()| decode_display(&bytes, ImageFormat::Jpeg))
        }
        Format::Hdr => radiance::decode(&bytes),
        #[cfg(feature = "exr")]
        Format::Exr => openexr::decode(&bytes),
        #[cfg(not(all(feature = "exr", feature = "jpeg", feature = "png")))]
        _ => Err(DecodeError::NotBuiltIn),
    }))
    .unwrap_or_else(|_| Err(DecodeError::reason("the decoder gave up; the file is damaged")));
    decoded.map_err(|error| {
        let path = path.to_owned();
        match error {
            DecodeError::Reason(reason) => PictureError::Decode { path, format, reason },
            DecodeError::Size(width, height) => PictureError::BadSize { path, width, height },
            #[cfg(not(all(feature = "exr", feature = "jpeg", feature = "png")))]
            DecodeError::NotBuiltIn => PictureError::NotBuiltIn { path, format },
            #[cfg(feature = "exr")]
            DecodeError::Channels(found) => PictureError::NoColorChannels { path, found },
        }
    })
}

fn read_file(path: &Path) -> Result<Vec<u8>, PictureError> {
    let io = |source| PictureError::Read { path: path.to_owned(), source };
    // Checked before opening, because opening a pipe would wait for its writer.
    let metadata = std::fs::metadata(path).map_err(io)?;
    if !metadata.is_file() {
        return Err(PictureError::NotAFile { path: path.to_owned() });
    }
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes))
        .map_err(io)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(PictureError::FileTooLong { path: path.to_owned(), n_bytes: metadata.len() });
    }
    Ok(bytes)
}

fn format_from_content(bytes: &[u8]) -> Option<Format> {
    const SIGNATURES: [(&[u8], Format); 5] = [
        (b"\x89PNG\r\n\x1a\n", Format::Png),
        (b"\xff\xd8\xff", Format::Jpeg),
        (b"\x76\x2f\x31\x01", Format::Exr),
        (b"#?RADIANCE", Format::Hdr),
        (b"#?RGBE", Format::Hdr),
    ];
    SIGNATURES.iter().find(|(signature, _)| bytes.starts_with(signature)).map(|&(_, format)| format)
}

/// The size as `usize`s, if a picture may have this size.
pub(super) fn checked_size(width: u64, height: u64) -> Result<(usize, usize), DecodeError> {
    match width.checked_mul(height) {
        Some(1..=MAX_PIXELS) => Ok((width as usize, height as usize)),
        _ => Err(DecodeError::Size(width, height)),
    }
}

/// PNG and JPEG: sRGB values of 8 or 16 bits.
#[cfg(any(feature = "jpeg", feature = "png"))]
fn decode_display(bytes: &[u8], format: ImageFormat) -> Result<Picture, DecodeError> {
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_DECODER_BYTES);
    let mut reader = ImageReader::with_format(std::io::Cursor::new(bytes), format);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(DecodeError::reason)?;
    let (width, height) = decoder.dimensions();
    checked_size(width.into(), height.into())?;
    let image = DynamicImage::from_decoder(decoder).map_err(DecodeError::reason)?;
    let is_16_bit = matches!(
        image,
        DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgb16(_)
            | DynamicImage::ImageRgba16(_)
    );
    let rgb = if is_16_bit {
        let table = &LINEAR_FROM_WORD;
        image
            .into_rgb16()
            .pixels()
            .map(|p| Vec3::from(p.0.map(|v| table[usize::from(v)])))
            .collect()
    } else {
        let table = &LINEAR_FROM_BYTE;
        image.into_rgb8().pixels().map(|p| Vec3::from(p.0.map(|v| table[usize::from(v)]))).collect()
    };
    Ok(Picture { width, height, rgb })
}

/// Rejects a JPEG that ends before its end marker, because the decoder would fill the missing part with grey.
///
/// ITU-T T.81, B.1.1: segments of marker, length and content; after a start-of-scan segment, coded data
/// in which 0xff is followed by 0 or a restart marker.
#[cfg(feature = "jpeg")]
fn check_jpeg_is_whole(bytes: &[u8]) -> Result<(), DecodeError> {
    const START_OF_SCAN: u8 = 0xda;
    const END_OF_IMAGE: u8 = 0xd9;
    let cut_short = || {
        DecodeError::reason(
            "it is truncated or damaged: its end marker is missing; get the whole file",
        )
    };
    let mut at = 2;
    loop {
        // To the next marker: 0xff, and then neither a stuffed 0, a fill byte 0xff nor a restart marker.
        let rest = bytes.get(at..).ok_or_else(cut_short)?;
        let offset = rest
            .windows(2)
            .position(|pair| pair[0] == 0xff && !matches!(pair[1], 0x00 | 0xff | 0xd0..=0xd7))
            .ok_or_else(cut_short)?;
        let marker = rest[offset + 1];
        at += offset + 2;
        if marker == END_OF_IMAGE {
            return Ok(());
        }
        let length = bytes.get(at..at + 2).ok_or_else(cut_short)?;
        let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
        // The coded data of a scan follows its header, and is searched for the next marker like any gap.
        at += if marker == START_OF_SCAN { length.max(2) } else { length };
    }
}
