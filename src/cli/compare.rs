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
    /// The picture that it should be.
    reference: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Write the FLIP error map.
    #[arg(long, value_name = "OUT.png")]
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
        println!("{}", serde_json::to_string_pretty(&result.to_json())?);
        return Ok(());
    }
    let triple = |v: [f64; 3]| format!("{:.6} {:.6} {:.6}", v[0], v[1], v[2]);
    println!("size                 {} x {}", result.width, result.height);
    println!("mean of test         {}", triple(result.mean_test));
    println!("mean of reference    {}", triple(result.mean_reference));
    println!("mean ratio           {}", triple(result.mean_ratio));
    println!("MSE                  {:.6e}", result.mse);
    println!("RMSE                 {:.6e}", result.rmse);
    println!("relative RMSE        {:.6}", result.relative_rmse);
    println!("PSNR                 {:.3} dB", result.psnr_db);
    match result.ssim {
        Some(ssim) => println!("SSIM                 {ssim:.6}"),
        None => println!("SSIM                 - (needs 11 x 11 pixels)"),
    }
    println!("mean L* error        {:.4}", result.mean_lightness_error);
    println!("mean FLIP            {:.6}", result.mean_flip);
    Ok(())
}
