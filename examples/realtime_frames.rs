// SPDX-License-Identifier: MIT OR Apache-2.0
//! A renderer's own frame loop: its encoder, its submissions, `voxel-rt` for indirect light.
//!
//! `cargo run --example realtime_frames [OUT.png]`; the file is `realtime_frames.png` in the system's folder of
//! temporary files by default.

use glam::UVec2;
use lucerna::blocking::{open, read_film};
use lucerna::frame::{DirectSettings, FramePasses, View, ViewSettings};
use lucerna::gpu::{AdapterChoice, Recorder};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::picture::PngOptions;
use lucerna::scene::{LoadLimits, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, resolve};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use std::path::{Path, PathBuf};

const N_FRAMES: u32 = 48;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/scenes/cornell_original/cornell_original.gltf");
    let loaded = Scene::load(&file, &LoadLimits::default())?.scene;
    let camera = loaded.cameras.first().ok_or("the file has no camera")?;
    // A renderer passes its own device to `Gpu::new`.
    let (gpu, info) = open(&AdapterChoice::Auto)?;
    eprintln!("adapter: {}", info.name);
    let scene = GpuScene::new(&gpu, &loaded, GpuSceneOptions::default())?;

    let size = UVec2::new(128, 128);
    let settings = settings!(VoxelRtSettings { resolution: 32, ..Default::default() });
    let mut technique = VoxelRt::new(&gpu, &scene, settings, camera.position)?;
    let mut passes = FramePasses::new(&gpu, &scene, size, DirectSettings::default())?;
    let mut view = View::new(size);
    let view_settings =
        settings!(ViewSettings { n_accumulated: N_FRAMES / 2, ..ViewSettings::default() });
    for frame_ix in 0..N_FRAMES {
        if frame_ix == N_FRAMES / 2 {
            // From here on the picture is kept.
            passes.accumulator.reset();
        }
        view.advance(&scene, camera, &view_settings);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(&gpu, &mut encoder);
        passes.record(&mut recorder, &scene, &view, &mut technique)?;
        drop(recorder);
        // Other passes may be recorded here; they can read `passes.gbuffer`.
        gpu.queue.submit([encoder.finish()]);
    }
    let picture = resolve(&read_film(&gpu, passes.accumulator.film())?, size, Channel::Beauty);

    let output = std::env::args_os()
        .nth(1)
        .map_or_else(|| std::env::temp_dir().join("realtime_frames.png"), PathBuf::from);
    picture.write(&output, &PngOptions::default())?;
    println!("{N_FRAMES} frames, {}", output.display());
    Ok(())
}
