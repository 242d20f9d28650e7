// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna compare`.

use super::CommandResult;
use clap::Args;
use lucerna::compare::{compare as measure, difference_picture};
use lucerna::picture::{Picture, PngOptions};
use std::path::PathBuf;

/// `lucerna compare`.
#[derive(Args, Clone, Debug)]
pub struct CompareArguments {
    /// The picture to judge: .png, .jpg, .hdr or .exr.
    test: PathBuf,
    /// The reference: the picture that it should match.
    reference: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write the FLIP error map.
    #[arg(long, value_name = "OUT.png", value_parser = super::render::parse_output)]
    diff: Option<PathBuf>,
}

pub fn compare(arguments: &CompareArguments) -> CommandResult {
    let test = Picture::read(&arguments.test)?;
    let reference = Picture::read(&arguments.reference)?;
    let result = measure(&test, &reference)?;
    if let Some(file) = &arguments.diff {
        difference_picture(&test, &reference)?.write(file, &PngOptions::default())?;
    }
    if arguments.json {
        outln!("{}", serde_json::to_string_pretty(&result.to_json())?)?;
        return Ok(());
    }
    // Six decimal places, or six digits in scientific notation for what is below 0.001.
    let number = |v: f64| {
        if v != 0.0 && v.abs() < 1e-3 { format!("{v:.6e}") } else { format!("{v:.6}") }
    };
    let triple = |v: [f64; 3]| v.map(number).join(" ");
    outln!("size                 {} x {}", result.width, result.height)?;
    outln!("mean of test         {}", triple(result.mean_test))?;
    outln!("mean of reference    {}", triple(result.mean_reference))?;
    outln!("mean ratio           {}", triple(result.mean_ratio))?;
    outln!("MSE                  {:.6e}", result.mse)?;
    outln!("RMSE                 {:.6e}", result.rmse)?;
    outln!("relative RMSE        {:.6}", result.relative_rmse)?;
    outln!("PSNR                 {:.3} dB", result.psnr_db)?;
    match result.ssim {
        Some(ssim) => outln!("SSIM                 {ssim:.6}")?,
        None => outln!("SSIM                 - (needs 11 x 11 pixels)")?,
    }
    outln!("mean L* error        {:.4}", result.mean_lightness_error)?;
    outln!("mean FLIP            {:.6}", result.mean_flip)?;
    Ok(())
}
