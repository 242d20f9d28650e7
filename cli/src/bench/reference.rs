// SPDX-License-Identifier: MIT OR Apache-2.0
//! The path tracer: samples per second.

use super::Row;
use glam::UVec2;
use lucerna::blocking::render_reference;
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Scene};
use lucerna::settings;
use lucerna::techniques::reference::ReferenceSettings;
use std::error::Error;

const SAMPLES: u32 = 8;
const ROUNDS: usize = 3;

pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for (name, diffuse_only) in [("Lambert", true), ("full materials", false)] {
        let gpu_scene =
            GpuScene::new(gpu, scene, settings!(GpuSceneOptions { rays: source, diffuse_only }))?;
        let settings = settings!(ReferenceSettings {
            size: UVec2::new(320, 180),
            n_bounces: 6,
            seed: 0,
            irradiance: false,
            occlusion_distance: 0.0,
        });
        // The first round also compiles; the fastest counts.
        let mut best = f64::INFINITY;
        for _ in 0..=ROUNDS {
            let (_, stats) =
                render_reference(gpu, &gpu_scene, camera, &settings, SAMPLES, |_| true)?;
            best = best.min(stats.gpu_time.unwrap_or(stats.wall_time).as_secs_f64());
        }
        let samples = f64::from(SAMPLES * settings.size.x * settings.size.y);
        rows.push(Row {
            name: format!("{name}, 320x180, 6 bounces"),
            value: samples / best / 1e6,
            unit: "Msamples/s",
            ratio: None,
        });
    }
    Ok(rows)
}
