// SPDX-License-Identifier: MIT OR Apache-2.0
//! Renders the Cornell box with the reference path tracer into a PNG file.
//!
//! `cargo run --example render_cornell [OUT.png]`; the file is `render_cornell.png` in the system's
//! folder of temporary files by default.

use glam::UVec2;
use lucerna::blocking::{open, render_reference};
use lucerna::gpu::AdapterChoice;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::picture::PngOptions;
use lucerna::scene::{LoadLimits, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/scenes/cornell_original/cornell_original.gltf");
    let loaded = Scene::load(&file, &LoadLimits::default())?;
    for warning in &loaded.warnings {
        eprintln!("warning: {warning}");
    }
    let camera = loaded.scene.cameras.first().ok_or("the file has no camera")?;

    let (gpu, info) = open(&AdapterChoice::Auto)?;
    eprintln!("adapter: {}", info.name);
    let scene = GpuScene::new(&gpu, &loaded.scene, GpuSceneOptions::default())?;

    let size = UVec2::new(128, 128);
    let settings = settings!(ReferenceSettings {
        size,
        n_bounces: 8,
        seed: 0,
        irradiance: false,
        occlusion_distance: 0.0,
    });
    let (sums, stats) = render_reference(&gpu, &scene, camera, &settings, 16, |_| true)?;
    let picture = resolve(&sums, size, Channel::Beauty);

    let output = std::env::args_os()
        .nth(1)
        .map_or_else(|| std::env::temp_dir().join("render_cornell.png"), PathBuf::from);
    picture.write(&output, &PngOptions::default())?;
    println!("{} samples per pixel in {}", stats.n_samples, output.display());
    Ok(())
}
