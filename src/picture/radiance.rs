// SPDX-License-Identifier: MIT OR Apache-2.0
//! Radiance HDR (RGBE): Ward, "Real Pixels", Graphics Gems II (1991), and the file format as the
//! Radiance manual's "File Formats" describes it.
//!
//! A pixel is three mantissas and a shared exponent: `value = mantissa · 2^(exponent − 136)`, 0 if the exponent is 0.
//! (Radiance's own library adds half a step on reading, because it truncates on writing; other readers do not. This one
//! rounds to nearest on writing, and adds nothing on reading.)

use std::io::{self, Write};

use glam::{DVec3, Vec3};

use super::Picture;
use super::read::{DecodeError, checked_size};

/// Exponent bias 128, and 8 bits of mantissa.
const EXPONENT_BIAS: i32 = 136;
/// Widths that new-style run-length coding can store.
const RUN_LENGTH_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;
/// A longer line is not a header line.
const MAX_LINE_BYTES: usize = 1 << 16;

type Rgbe = [u8; 4];

pub(super) fn decode(bytes: &[u8]) -> Result<Picture, DecodeError> {
    let mut input = Input { bytes, at: 0 };
    // Recorded values are divided by both.
    let mut exposure = DVec3::ONE;
    input.line()?;
    loop {
        let line = input.line()?;
        if line.is_empty() {
            break;
        }
        let Some((key, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) else {
            continue;
        };
        let numbers =
            || value.split_whitespace().map(str::parse::<f64>).collect::<Result<Vec<_>, _>>();
        match key.trim() {
            "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                return Err(DecodeError::Reason(format!(
                    "its pixels are {:.40}, not 32-bit_rle_rgbe; convert it",
                    value.trim()
                )));
            }
            "EXPOSURE" => match numbers().as_deref() {
                Ok(&[e]) => exposure *= e,
                _ => return Err(bad_line(&line)),
            },
            "COLORCORR" => match numbers().as_deref() {
                Ok(&[r, g, b]) => exposure *= DVec3::new(r, g, b),
                _ => return Err(bad_line(&line)),
            },
            _ => {}
        }
    }
    if !(exposure.is_finite() && exposure.min_element() > 0.0) {
        return Err(DecodeError::reason(
            "its EXPOSURE or COLORCORR is not a positive number; correct the header",
        ));
    }
    let line = input.line()?;
    let words: Vec<_> = line.split_whitespace().collect();
    let &["-Y", height, "+X", width] = words.as_slice() else {
        return Err(DecodeError::Reason(format!(
            "its size line is \"{line:.40}\", but only \"-Y height +X width\" is supported; rotate the picture upright"
        )));
    };
    let (Ok(width), Ok(height)) = (width.parse::<u32>(), height.parse::<u32>()) else {
        return Err(bad_line(&line));
    };
    let (n_columns, n_rows) = checked_size(width.into(), height.into())?;
    // Grows with what the file contains, not with what it claims.
    let mut rgb = Vec::new();
    let mut row = vec![[0; 4]; n_columns];
    for y in 0..n_rows {
        input.row(&mut row).map_err(|e| match e {
            RowError::CutShort => {
                DecodeError::Reason(format!("it ends in row {y} of {n_rows}; get the whole file"))
            }
            RowError::BadRun => DecodeError::Reason(format!(
                "row {y} is not {n_columns} pixels wide; the file is damaged"
            )),
        })?;
        rgb.extend(row.iter().map(|&p| (linear_from_rgbe(p) / exposure).as_vec3()));
    }
    Ok(Picture { width, height, rgb })
}

fn bad_line(line: &str) -> DecodeError {
    DecodeError::Reason(format!("its header line \"{line:.40}\" is not valid; correct the header"))
}

fn linear_from_rgbe([r, g, b, e]: Rgbe) -> DVec3 {
    if e == 0 {
        return DVec3::ZERO;
    }
    DVec3::new(r.into(), g.into(), b.into()) * f64::from(i32::from(e) - EXPONENT_BIAS).exp2()
}

/// The nearest RGBE. Negative channels become 0, channels above 255 · 2¹¹⁹ this value, and a pixel whose largest
/// channel is below 2⁻¹²⁸ becomes black. The pixel must be finite.
fn rgbe_from_linear(rgb: Vec3) -> Rgbe {
    const LARGEST: f64 = 255.0 * (1u128 << 119) as f64;
    let rgb = rgb.as_dvec3().clamp(DVec3::ZERO, DVec3::splat(LARGEST));
    let largest = rgb.max_element();
    if largest < (-128f64).exp2() {
        return [0; 4];
    }
    // f64 holds every positive f32 as a normal number: its exponent field is floor(log2) + 1023.
    let floor_log2 = ((largest.to_bits() >> 52) as i32) - 1023;
    // largest in 2^k..2^(k+1) has mantissas of 128..256 at e = k + 129; 255.5 and more rounds to 256: one up.
    let mut exponent = floor_log2 + EXPONENT_BIAS - 7;
    let mantissas = |exponent: i32| (rgb * f64::from(EXPONENT_BIAS - exponent).exp2()).round();
    if mantissas(exponent).max_element() > 255.0 {
        exponent += 1;
    }
    let m = mantissas(exponent);
    [m.x as u8, m.y as u8, m.z as u8, exponent as u8]
}

pub(super) fn encode(picture: &Picture, writer: &mut impl Write) -> io::Result<()> {
    write!(
        writer,
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n",
        picture.height, picture.width
    )?;
    let width = picture.width as usize;
    for row in picture.rgb.chunks_exact(width) {
        let row: Vec<Rgbe> = row.iter().map(|&rgb| rgbe_from_linear(rgb)).collect();
        // A flat pixel is never taken for a run or a run-length row: its largest mantissa is at least 128,
        // and the marks have none above 2 there.
        if !RUN_LENGTH_WIDTHS.contains(&width) {
            writer.write_all(row.as_flattened())?;
            continue;
        }
        writer.write_all(&[2, 2, (width >> 8) as u8, width as u8])?;
        for component in 0..4 {
            let values: Vec<u8> = row.iter().map(|p| p[component]).collect();
            write_runs(&values, writer)?;
        }
    }
    Ok(())
}

/// Runs as (128 + length, value), the rest as (length, values…); lengths up to 127 and 128.
fn write_runs(values: &[u8], writer: &mut impl Write) -> io::Result<()> {
    /// Shorter runs cost more than they save.
    const SHORTEST_RUN: usize = 3;
    let run_at = |start: usize| {
        values[start..].iter().take(127).take_while(|&&v| v == values[start]).count()
    };
    let mut start = 0;
    while start < values.len() {
        let run = run_at(start);
        if run >= SHORTEST_RUN {
            writer.write_all(&[128 + run as u8, values[start]])?;
            start += run;
            continue;
        }
        let mut end = start + run;
        while end < values.len() && end - start < 128 && run_at(end) < SHORTEST_RUN {
            end += 1;
        }
        writer.write_all(&[(end - start) as u8])?;
        writer.write_all(&values[start..end])?;
        start = end;
    }
    Ok(())
}

enum RowError {
    CutShort,
    BadRun,
}

/// A position in the file.
struct Input<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Input<'_> {
    /// The next header line, without its end.
    fn line(&mut self) -> Result<String, DecodeError> {
        let rest = &self.bytes[self.at..];
        let searched = &rest[..rest.len().min(MAX_LINE_BYTES)];
        let Some(length) = searched.iter().position(|&b| b == b'\n') else {
            return Err(DecodeError::reason("it ends in its header; get the whole file"));
        };
        self.at += length + 1;
        Ok(String::from_utf8_lossy(&rest[..length]).trim_end_matches('\r').to_owned())
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], RowError> {
        let taken = self.bytes[self.at..].first_chunk::<N>().ok_or(RowError::CutShort)?;
        self.at += N;
        Ok(*taken)
    }

    fn row(&mut self, row: &mut [Rgbe]) -> Result<(), RowError> {
        let first = self.take::<4>()?;
        if first[0] != 2
            || first[1] != 2
            || first[2] >= 128
            || !RUN_LENGTH_WIDTHS.contains(&row.len())
        {
            return self.flat_row(first, row);
        }
        if usize::from(u16::from_be_bytes([first[2], first[3]])) != row.len() {
            return Err(RowError::BadRun);
        }
        for component in 0..4 {
            let mut x = 0_usize;
            while x < row.len() {
                let [code] = self.take()?;
                let is_run = code > 128;
                let length = usize::from(if is_run { code - 128 } else { code });
                let target =
                    row.get_mut(x..x + length).filter(|t| !t.is_empty()).ok_or(RowError::BadRun)?;
                let mut value = if is_run { self.take::<1>()?[0] } else { 0 };
                for pixel in target {
                    if !is_run {
                        [value] = self.take()?;
                    }
                    pixel[component] = value;
                }
                x += length;
            }
        }
        Ok(())
    }

    /// Pixels one by one, and old-style runs: mantissas 1, 1, 1 repeat the pixel before; a mark that
    /// follows another one counts 256 times as much.
    fn flat_row(&mut self, first: Rgbe, row: &mut [Rgbe]) -> Result<(), RowError> {
        let mut x = 0_usize;
        let mut shift = 0;
        let mut pixel = first;
        loop {
            if let [1, 1, 1, count] = pixel {
                let count = if shift < 32 {
                    usize::from(count) << shift
                } else {
                    usize::from(count > 0) * usize::MAX
                };
                shift += 8;
                let before = x.checked_sub(1).map(|x| row[x]).ok_or(RowError::BadRun)?;
                let end = x.checked_add(count).ok_or(RowError::BadRun)?;
                row.get_mut(x..end).ok_or(RowError::BadRun)?.fill(before);
                x = end;
            } else {
                shift = 0;
                row[x] = pixel;
                x += 1;
            }
            if x == row.len() {
                return Ok(());
            }
            pixel = self.take()?;
        }
    }
}
