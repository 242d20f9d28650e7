// SPDX-License-Identifier: MIT OR Apache-2.0
//! OpenEXR, flat RGB or luminance.

use std::io::{self, BufWriter, Cursor, Write};

use exr::block::reader::Reader;
use exr::image::read::specific_channels::ReadSpecificChannel;
use exr::image::{Encoding, Image, Layer, SpecificChannels};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{ReadChannels as _, ReadLayers as _, WritableImage as _};
use glam::Vec3;

use super::Picture;
use super::read::{DecodeError, checked_size};

/// The largest block (tile, or group of rows) of a file, uncompressed: decoders hold a few at a time.
const MAX_BLOCK_BYTES: u128 = 1 << 28;

/// The value of pixels that the file has not filled yet: a NaN that no arithmetic produces.
const UNFILLED: f32 = f32::from_bits(0x7fa5_5a01);

/// The channels that the picture is made from.
enum Channels {
    Rgb,
    Luminance,
}

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, DecodeError> {
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(reason)?;
    let (header, channels) = select_layer(reader.headers())?;
    let display = header.shared_attributes.display_window;
    let (width, height) = checked_size(display.size.width() as u64, display.size.height() as u64)?;
    let data_position = header.own_attributes.layer_position;
    let data_size = header.layer_size;
    // In i64: the file chooses these numbers.
    let offset_x = i64::from(data_position.x()) - i64::from(display.position.x());
    let offset_y = i64::from(data_position.y()) - i64::from(display.position.y());
    let pixel_ix = move |x: usize, y: usize| {
        let x = usize::try_from(x as i64 + offset_x).ok().filter(|&x| x < width)?;
        let y = usize::try_from(y as i64 + offset_y).ok().filter(|&y| y < height)?;
        Some(y * width + x)
    };
    let create = move || {
        let mut rgb = vec![Vec3::ZERO; width * height];
        for y in 0..data_size.height() {
            for x in 0..data_size.width() {
                if let Some(ix) = pixel_ix(x, y) {
                    rgb[ix].x = UNFILLED;
                }
            }
        }
        rgb
    };
    let set = move |rgb: &mut Vec<Vec3>, position: Vec2<usize>, value: Vec3| {
        if let Some(pixel) = pixel_ix(position.x(), position.y()).and_then(|ix| rgb.get_mut(ix)) {
            *pixel = value;
        }
    };
    let rgb = match channels {
        Channels::Rgb => read_rgb(reader, create, set),
        Channels::Luminance => read_luminance(reader, create, set),
    }
    .map_err(reason)?;
    if rgb.iter().any(|rgb| rgb.x.to_bits() == UNFILLED.to_bits()) {
        return Err(DecodeError::reason("some of its blocks are missing; get the whole file"));
    }
    Ok(Picture { width: width as u32, height: height as u32, rgb })
}

fn read_rgb(
    reader: Reader<Cursor<&[u8]>>,
    create: impl Fn() -> Vec<Vec3> + 'static,
    set: impl Fn(&mut Vec<Vec3>, Vec2<usize>, Vec3) + 'static,
) -> exr::error::Result<Vec<Vec3>> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            move |_, _| create(),
            move |rgb, at, (r, g, b): (f32, f32, f32)| set(rgb, at, Vec3::new(r, g, b)),
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)?;
    Ok(image.layer_data.channel_data.pixels)
}

fn read_luminance(
    reader: Reader<Cursor<&[u8]>>,
    create: impl Fn() -> Vec<Vec3> + 'static,
    set: impl Fn(&mut Vec<Vec3>, Vec2<usize>, Vec3) + 'static,
) -> exr::error::Result<Vec<Vec3>> {
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("Y")
        .collect_pixels(
            move |_, _| create(),
            move |rgb, at, (y,): (f32,)| set(rgb, at, Vec3::splat(y)),
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)?;
    Ok(image.layer_data.channel_data.pixels)
}

/// The first layer with R, G and B, or else with Y and no chroma; rejects what the decoder cannot read.
fn select_layer(headers: &[Header]) -> Result<(&Header, Channels), DecodeError> {
    for header in headers {
        if header.deep {
            return Err(DecodeError::reason("it holds deep data; flatten it"));
        }
        let block_pixels = match header.blocks {
            BlockDescription::Tiles(tiles) => {
                tiles.tile_size.width() as u128 * tiles.tile_size.height() as u128
            }
            BlockDescription::ScanLines => {
                header.compression.scan_lines_per_block() as u128
                    * header.layer_size.width() as u128
            }
        };
        if block_pixels * header.channels.bytes_per_pixel as u128 > MAX_BLOCK_BYTES {
            return Err(DecodeError::reason(
                "one of its blocks claims more than 256 MiB; the file is damaged",
            ));
        }
        checked_size(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    }
    let has = |header: &Header, name: &str| header.channels.list.iter().any(|c| c.name.eq(name));
    let is_rgb = |header: &Header| ["R", "G", "B"].iter().all(|name| has(header, name));
    let is_luminance =
        |header: &Header| has(header, "Y") && !has(header, "RY") && !has(header, "BY");
    let (header, channels) = if let Some(header) = headers.iter().find(|h| is_rgb(h)) {
        (header, Channels::Rgb)
    } else if let Some(header) = headers.iter().find(|h| is_luminance(h)) {
        (header, Channels::Luminance)
    } else {
        let names = |header: &Header| {
            header.channels.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>().join(", ")
        };
        let found = headers.iter().map(names).collect::<Vec<_>>().join("; ");
        // A hostile file can name thousands of channels.
        return Err(DecodeError::Channels(found.chars().take(200).collect()));
    };
    if header.shared_attributes.chromaticities.is_some_and(|c| !is_rec_709(&c)) {
        tracing::warn!(
            "the EXR file has other primaries than Rec. 709; its values are read as Rec. 709 anyway"
        );
    }
    Ok((header, channels))
}

fn is_rec_709(c: &exr::meta::attribute::Chromaticities) -> bool {
    let near = |v: Vec2<f32>, x: f32, y: f32| (v.x() - x).abs() < 1e-3 && (v.y() - y).abs() < 1e-3;
    near(c.red, 0.64, 0.33)
        && near(c.green, 0.30, 0.60)
        && near(c.blue, 0.15, 0.06)
        && near(c.white, 0.3127, 0.329)
}

/// Writes f32 channels R, G, B, ZIP-compressed in groups of 16 rows. The picture's size is right.
pub(super) fn encode(picture: &Picture, writer: &mut BufWriter<std::fs::File>) -> io::Result<()> {
    let width = picture.width as usize;
    let pixel = |at: Vec2<usize>| {
        let rgb = picture.rgb[at.y() * width + at.x()];
        (rgb.x, rgb.y, rgb.z)
    };
    let size = Vec2(width, picture.height as usize);
    let layer = Layer::new(
        size,
        LayerAttributes::default(),
        Encoding::SMALL_LOSSLESS,
        SpecificChannels::rgb(pixel),
    );
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut *writer).map_err(
        |e| match e {
            exr::error::Error::Io(e) => e,
            e => io::Error::other(e),
        },
    )?;
    writer.flush()
}

fn reason(error: exr::error::Error) -> DecodeError {
    DecodeError::Reason(format!(
        "{error}; the file is truncated, damaged or of an unsupported kind"
    ))
}
