// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-rt` pass by pass: next to its source's configuration, and how cost grows with rays and pixels.

use super::Row;
use super::frames::{Bench, PICTURE, Passes, sum_of, with_light};
use glam::UVec2;
use lucerna::components::voxel_light::{Bounces, DirectLight, RaysInjected, WriteStrategy};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Scene};
use lucerna::settings;
use lucerna::techniques::voxel_rt::{Lookup, VoxelRt, VoxelRtSettings};
use std::error::Error;

/// The source's number of cells along the longest side, and of rays along each side of the light's square.
const CELLS: u32 = 128;
const RAYS: u32 = 512;
const BASELINE: &str = "store, 1 bounce";
const VOXELIZE: [&str; 2] = ["voxels/voxelize", "voxel_light/carry"];

/// `quick`: pictures with a quarter of the width and height, and half the cells and rays.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
    quick: bool,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let scene = with_light(scene);
    let options = settings!(GpuSceneOptions { rays: source, diffuse_only: true });
    let gpu_scene = GpuScene::new(gpu, &scene, options)?;
    let bench = Bench { gpu, scene: &gpu_scene, camera };
    let (picture, cells, n_rays) =
        if quick { (PICTURE / 4, CELLS / 2, RAYS / 2) } else { (PICTURE, CELLS, RAYS) };
    let from_lights =
        |strategy| DirectLight::FromLights(settings!(RaysInjected { n_rays, strategy }));
    let ours = settings!(VoxelRtSettings { resolution: cells, ..Default::default() });
    let sources = settings!(VoxelRtSettings {
        anisotropic: false,
        direct: from_lights(WriteStrategy::Store),
        bounces: Bounces::UpTo(1),
        lookup: Lookup::SevenTap,
        ..ours
    });
    let configurations = [
        (BASELINE, sources),
        (
            "moving average, 1 bounce",
            settings!(VoxelRtSettings {
                direct: from_lights(WriteStrategy::MovingAverage),
                ..sources
            }),
        ),
        (
            "exact, 1 bounce",
            settings!(VoxelRtSettings { direct: from_lights(WriteStrategy::Exact), ..sources }),
        ),
        (
            "exact, 6 faces, all bounces",
            settings!(VoxelRtSettings { direct: from_lights(WriteStrategy::Exact), ..ours }),
        ),
        ("default", ours),
    ];
    let mut rows = Vec::new();
    let mut baseline = None;
    let all = passes(&bench, &configurations.map(|(_, settings)| (picture, settings)))?;
    for ((name, _), passes) in configurations.iter().zip(all) {
        let total: f64 = passes.iter().map(|(_, ms)| ms).sum();
        let baseline = *baseline.get_or_insert(total);
        for (pass, ms) in passes {
            rows.push(Row::new(format!("{name}: {pass}"), ms, "ms"));
        }
        let ratio = (*name != BASELINE).then_some((total / baseline, BASELINE));
        rows.push(Row { ratio, ..Row::new(format!("{name}: total"), total, "ms") });
    }
    // Shading per pixel for any number of rays, and injection per ray for any number of pixels.
    let sizes = [
        (picture / 4, n_rays),
        (picture / 2, n_rays),
        (picture, n_rays),
        (picture / 2, n_rays / 2),
        (picture / 2, 2 * n_rays),
    ];
    let injected = |n_rays| {
        settings!(VoxelRtSettings {
            direct: DirectLight::FromLights(settings!(RaysInjected {
                n_rays,
                strategy: WriteStrategy::Exact
            })),
            ..ours
        })
    };
    let all = passes(&bench, &sizes.map(|(size, n_rays)| (size, injected(n_rays))))?;
    for ((size, n_rays), passes) in sizes.into_iter().zip(all) {
        let of = |name| sum_of(&passes, &[name]);
        let name = format!("{} x {}, {n_rays}^2 rays", size.x, size.y);
        let (n_pixels, n_rays) = (f64::from(size.element_product()), f64::from(n_rays).powi(2));
        rows.push(Row::new(
            format!("{name}: shade"),
            1e6 * of("voxel_rt/shade") / n_pixels,
            "ns/pixel",
        ));
        rows.push(Row::new(
            format!("{name}: inject"),
            1e6 * of("voxel_light/inject") / n_rays,
            "ns/ray",
        ));
    }
    Ok(rows)
}

/// The technique's passes with these settings.
fn passes(
    bench: &Bench,
    configurations: &[(UVec2, VoxelRtSettings)],
) -> Result<Vec<Passes>, Box<dyn Error>> {
    let mut rigs = Vec::new();
    for &(size, settings) in configurations {
        let technique = VoxelRt::new(bench.gpu, bench.scene, settings, bench.camera.position)?;
        rigs.push(bench.rig(size, technique)?);
    }
    let mut all = bench.run(&mut rigs, &VOXELIZE)?;
    for passes in &mut all {
        passes.retain(|(name, _)| name.starts_with("voxel"));
    }
    Ok(all)
}
