// SPDX-License-Identifier: MIT OR Apache-2.0
//! Writes pictures to files.

use std::io;
use std::path::Path;

#[cfg(feature = "exr")]
use super::openexr;
use super::{Format, Picture, PictureError, ToneMap, radiance, write_whole_file};

/// How linear values become the display values of a PNG.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PngOptions {
    /// Values are multiplied by 2 to this power first; 0 leaves them unchanged.
    pub exposure_ev: f32,
    /// Applied after the exposure; None: values above 1 are clipped.
    pub tone_map: Option<ToneMap>,
}

pub(super) fn write(picture: &Picture, path: &Path, png: &PngOptions) -> Result<(), PictureError> {
    let format = format_from_ending(path)?;
    picture.check_size()?;
    if format != Format::Exr {
        picture.check_finite()?;
    }
    if format == Format::Png && !png.exposure_ev.is_finite() {
        return Err(PictureError::BadExposure { exposure_ev: png.exposure_ev });
    }
    let written: io::Result<()> = match format {
        #[cfg(feature = "exr")]
        Format::Exr => write_whole_file(path, |writer| openexr::encode(picture, writer)),
        Format::Hdr => write_whole_file(path, |writer| radiance::encode(picture, writer)),
        #[cfg(feature = "png")]
        Format::Png => write_whole_file(path, |writer| encode_png(picture, png, writer)),
        _ => return Err(PictureError::NotBuiltIn { path: path.to_owned(), format }),
    };
    written.map_err(|source| PictureError::Write { path: path.to_owned(), source })
}

/// PNG, HDR or EXR.
fn format_from_ending(path: &Path) -> Result<Format, PictureError> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match ending.as_deref() {
        Some("png") => Ok(Format::Png),
        Some("hdr") => Ok(Format::Hdr),
        Some("exr") => Ok(Format::Exr),
        _ => Err(PictureError::UnknownEnding { path: path.to_owned() }),
    }
}

#[cfg(feature = "png")]
fn encode_png(picture: &Picture, options: &PngOptions, writer: impl io::Write) -> io::Result<()> {
    use image::ImageEncoder;

    let bytes = display_bytes(&picture.rgb, options);
    image::codecs::png::PngEncoder::new(writer)
        .write_image(&bytes, picture.width, picture.height, image::ExtendedColorType::Rgb8)
        .map_err(|e| match e {
            image::ImageError::IoError(e) => e,
            e => io::Error::other(e),
        })
}

/// Three bytes per pixel. The pixels must be finite.
#[cfg(feature = "png")]
fn display_bytes(rgb: &[glam::Vec3], options: &PngOptions) -> Vec<u8> {
    let scale = f64::from(options.exposure_ev).exp2();
    rgb.iter()
        .flat_map(|&rgb| {
            let mut exposed = rgb.as_dvec3() * scale;
            if let Some(tone_map) = options.tone_map {
                exposed = tone_map.apply(exposed.as_vec3()).as_dvec3();
            }
            exposed.to_array().map(super::srgb::byte_from_linear)
        })
        .collect()
}
