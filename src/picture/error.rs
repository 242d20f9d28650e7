// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can go wrong with an image file.

use std::fmt;
use std::path::PathBuf;

use super::{MAX_FILE_BYTES, MAX_PIXELS};

/// An image file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// Radiance RGBE.
    Hdr,
    /// OpenEXR.
    Exr,
}

impl Format {
    /// The feature of this crate that reads and writes it; None: always available.
    pub fn feature(self) -> Option<&'static str> {
        match self {
            Self::Png => Some("png"),
            Self::Jpeg => Some("jpeg"),
            Self::Hdr => None,
            Self::Exr => Some("exr"),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Hdr => "Radiance HDR",
            Self::Exr => "OpenEXR",
        })
    }
}

/// A colour channel; its number is its place in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// 0.
    Red = 0,
    /// 1.
    Green = 1,
    /// 2.
    Blue = 2,
}

impl Channel {
    /// The channels in the order they lie in a pixel.
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        })
    }
}

/// Why a picture could not be read, written or used: what, in which file, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The system could not read the file.
    #[error("cannot read {}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// It is a folder, a pipe or a device.
    #[error("cannot read {}: it is not a regular file; name an image file", path.display())]
    NotAFile {
        /// The path.
        path: PathBuf,
    },
    /// It is longer than [`MAX_FILE_BYTES`].
    #[error("cannot read {}: it is {n_bytes} bytes long, but at most {MAX_FILE_BYTES} are read; compress it or make the picture smaller", path.display())]
    FileTooLong {
        /// The file.
        path: PathBuf,
        /// Its length.
        n_bytes: u64,
    },
    /// The first bytes are not those of a known format.
    #[error("cannot read {}: its first bytes are not those of a PNG, JPEG, Radiance HDR or OpenEXR file; convert it to one of these", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The format is not supported by this build.
    #[error("{} is a {format} file, which this build of lucerna does not support; enable its feature `{}`", path.display(), format.feature().unwrap_or_default())]
    NotBuiltIn {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: Format,
    },
    /// The content is damaged, truncated, or of a kind that is not supported.
    #[error("cannot read {} as {format}: {reason}", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// The format according to its first bytes.
        format: Format,
        /// What is wrong and what to do.
        reason: String,
    },
    /// It has more than [`MAX_PIXELS`] pixels, or a part of the file claims more memory than such a picture needs.
    #[error("cannot read {}: it claims {width} x {height} pixels, but a picture can have 1 to {MAX_PIXELS}; make it smaller (or the file is damaged)", path.display())]
    BadSize {
        /// The file.
        path: PathBuf,
        /// Pixels in a row.
        width: u64,
        /// Rows.
        height: u64,
    },
    /// An EXR file does not have the channels of a colour.
    #[error("cannot read {}: no flat layer has the channels R, G, B or a lone Y (it has: {found}); save it as RGB", path.display())]
    NoColorChannels {
        /// The file.
        path: PathBuf,
        /// The channels that it has, by layer.
        found: String,
    },
    /// A value is NaN or infinite, where it must be finite.
    #[error(
        "the value at column {x}, row {y} (from the top left, from 0) is {value} in {channel}; only finite values can be used here (an .exr file can hold it)"
    )]
    NotFinite {
        /// Column, from 0 at the left.
        x: usize,
        /// Row, from 0 at the top.
        y: usize,
        /// The first channel of the pixel that is not finite.
        channel: Channel,
        /// NaN or ±∞.
        value: f32,
    },
    /// The length of [`Picture::rgb`](super::Picture::rgb) does not match the size.
    #[error(
        "a picture of {width} x {height} pixels has {n_pixels} values; fill it before using it"
    )]
    WrongLength {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Number of pixels.
        n_pixels: usize,
    },
    /// The picture has no pixel.
    #[error("a picture of {width} x {height} pixels is empty; it needs at least one pixel")]
    Empty {
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The name of the file to write does not end in the name of a format.
    #[error("cannot write {}: the name must end in .png (8-bit display values), .exr (linear f32) or .hdr (linear RGBE)", path.display())]
    UnknownEnding {
        /// The file.
        path: PathBuf,
    },
    /// The exposure is NaN or infinite.
    #[error("an exposure of {exposure_ev} EV is not possible; give a finite number")]
    BadExposure {
        /// The given exposure.
        exposure_ev: f32,
    },
    /// The file could not be written; nothing of it is left.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the system or the encoder.
        source: std::io::Error,
    },
}
