// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna sheet`: pictures side by side, with labels.

use super::CommandResult;
use clap::Args;
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::{FONT_6X13, FONT_6X13_BOLD};
use embedded_graphics::pixelcolor::BinaryColor;
use embedded_graphics::prelude::*;
use embedded_graphics::text::{Baseline, Text};
use lucerna::compare::compare;
use lucerna::glam::Vec3;
use lucerna::picture::{Picture, PngOptions};
use std::convert::Infallible;
use std::path::PathBuf;

/// `lucerna sheet`.
#[derive(Args, Clone, Debug)]
pub struct SheetArguments {
    /// A label and a picture (.png, .jpg, .hdr or .exr), as in `reference=truth.exr`; a file without a label gets its
    /// name as label. Pictures with the size of the first one are compared with it.
    #[arg(required = true, value_name = "[LABEL=]FILE", value_parser = parse_tile)]
    pictures: Vec<(String, PathBuf)>,
    /// The file to write: .png, .hdr or .exr.
    #[arg(short, long, value_name = "FILE", value_parser = super::render::parse_output)]
    output: PathBuf,
    /// Pictures per row.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..))]
    columns: u32,
    /// Brighten the pictures by this many stops (negative: darken).
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
}

fn parse_tile(text: &str) -> Result<(String, PathBuf), String> {
    let (label, file) = text.split_once('=').unwrap_or_else(|| {
        let stem = std::path::Path::new(text).file_stem().and_then(|stem| stem.to_str());
        (stem.unwrap_or(text), text)
    });
    if file.is_empty() {
        return Err("expected LABEL=FILE".into());
    }
    Ok((label.to_owned(), file.into()))
}

/// Gap between and around pictures \[pixels\].
const GAP: u32 = 8;
/// Height of a line of text \[pixels\].
const LINE: u32 = 14;

/// A picture with the lines above it.
struct Tile {
    picture: Picture,
    label: String,
    /// How much it differs from the first one.
    figures: String,
}

/// Black text on a white picture.
struct Canvas(Picture);

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.0.width, self.0.height)
    }
}

impl DrawTarget for Canvas {
    type Color = BinaryColor;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = Pixel<BinaryColor>>,
    {
        for Pixel(at, color) in pixels {
            let (Ok(x), Ok(y)) = (u32::try_from(at.x), u32::try_from(at.y)) else { continue };
            if x < self.0.width && y < self.0.height && color.is_on() {
                self.0.rgb[(y * self.0.width + x) as usize] = Vec3::ZERO;
            }
        }
        Ok(())
    }
}

impl Canvas {
    fn write(&mut self, text: &str, at: Point, is_bold: bool, width: u32) {
        let font = if is_bold { &FONT_6X13_BOLD } else { &FONT_6X13 };
        // What does not fit the picture's width is left out.
        let n = (width / font.character_size.width) as usize;
        let text: String = text.chars().take(n).collect();
        let style = MonoTextStyle::new(font, BinaryColor::On);
        let Ok(_) = Text::with_baseline(&text, at, style, Baseline::Top).draw(self);
    }

    /// A picture in a thin frame, because it may be as white as the sheet.
    fn put(&mut self, picture: &Picture, x: u32, y: u32) {
        for row in y - 1..=y + picture.height {
            let start = (row * self.0.width + x - 1) as usize;
            self.0.rgb[start..start + picture.width as usize + 2].fill(Vec3::splat(0.2));
        }
        for (row, pixels) in (y..).zip(picture.rgb.chunks_exact(picture.width as usize)) {
            let start = (row * self.0.width + x) as usize;
            self.0.rgb[start..start + pixels.len()].copy_from_slice(pixels);
        }
    }
}

pub fn sheet(arguments: &SheetArguments) -> CommandResult {
    let scale = arguments.exposure.exp2();
    let mut tiles: Vec<Tile> = Vec::new();
    for (label, file) in &arguments.pictures {
        let mut picture = Picture::read(file)?;
        picture.rgb.iter_mut().for_each(|rgb| *rgb *= scale);
        let figures = match tiles.first().map(|first| &first.picture) {
            None => String::new(),
            Some(first) if (first.width, first.height) != (picture.width, picture.height) => {
                String::from("another size")
            }
            Some(first) => {
                let result = compare(&picture, first)?;
                let mean = result.mean_ratio.iter().sum::<f64>() / 3.0;
                format!("mean × {mean:.3}, FLIP {:.3}", result.mean_flip)
            }
        };
        tiles.push(Tile { picture, label: label.clone(), figures });
    }

    let columns = arguments.columns.min(tiles.len() as u32);
    let rows = (tiles.len() as u32).div_ceil(columns);
    let largest = |of: fn(&Picture) -> u32| tiles.iter().map(|tile| of(&tile.picture)).max();
    let [widest, highest] =
        [largest(|of| of.width), largest(|of| of.height)].map(Option::unwrap_or_default);
    let longest = tiles.iter().map(|tile| tile.figures.chars().count()).max().unwrap_or_default();
    let cell = [widest.max(longest as u32 * FONT_6X13.character_size.width), highest];
    let step = (cell[0] + GAP, cell[1] + 2 * LINE + GAP);
    let (width, height) = (columns * step.0 + GAP, rows * step.1 + GAP);
    let rgb = vec![Vec3::ONE; width as usize * height as usize];
    let mut canvas = Canvas(Picture { width, height, rgb });
    for (ix, tile) in (0..).zip(&tiles) {
        let (x, y) = (GAP + ix % columns * step.0, GAP + ix / columns * step.1);
        let at = |line: u32| Point::new(x as i32, (y + line * LINE) as i32);
        canvas.write(&tile.label, at(0), true, cell[0]);
        canvas.write(&tile.figures, at(1), false, cell[0]);
        canvas.put(&tile.picture, x, y + 2 * LINE);
    }
    canvas.0.write(&arguments.output, &PngOptions::default())?;
    Ok(())
}
