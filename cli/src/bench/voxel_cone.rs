// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-cone`: the passes of its source's table, its own, and what a step of a cone costs.

use super::Row;
use super::frames::{Bench, PICTURE, Passes, Rig, sum_of, with_light};
use glam::{UVec2, UVec3, Vec3};
use lucerna::blocking::read_buffer;
use lucerna::components::shadow_maps::{ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::components::voxel_pyramid::{
    Cone, ConeResult, ConeStepping, FaceWeights, PyramidStorage, TracePass,
};
use lucerna::components::voxels::Resolution;
use lucerna::frame::{DirectPass, DirectSettings};
use lucerna::gpu::{Gpu, PassTimers, Recorder};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Scene};
use lucerna::settings;
use lucerna::techniques::voxel_cone::{Specular, Tracing, VoxelCone, VoxelConeSettings};
use std::error::Error;
use wgpu::util::DeviceExt;

/// The source's cells.
const CELLS: UVec3 = UVec3::new(128, 64, 64);
const MOVED: [&str; 4] =
    ["voxels/voxelize", "voxels/attributes", "voxel_light/carry", "shadow_maps/depth"];
/// The passes that voxelize, and that light and prefilter the voxels.
const VOXELIZATION: [&str; 7] = [
    "voxels/voxelize",
    "voxels/attributes",
    "voxel_light/carry",
    "voxel_light/gather",
    "voxel_light/publish",
    "voxel_pyramid/fill",
    "voxel_pyramid/prefilter",
];
/// The source's passes: its name for each, our passes, and the time it reports.
const SOURCE: [(&str, &[&str], f64, &str); 7] = [
    ("shadow maps", &["shadow_maps/depth"], 0.40, "source's 0.40 ms (RTX 2080 Super)"),
    ("voxelization", &VOXELIZATION, 1.48, "source's 1.48 ms"),
    ("G-buffer", &["frame/gbuffer"], 0.29, "source's 0.29 ms"),
    ("bounce", &["voxel_cone/bounce"], 6.95, "source's 6.95 ms"),
    ("SSSO", &["voxel_cone/occlusion_specular"], 1.41, "source's 1.41 ms"),
    ("SSSO filter", &["voxel_cone/occlusion_resolve"], 0.29, "source's 0.29 ms"),
    ("deferred", &["frame/direct", "voxel_cone/shade"], 4.80, "source's 4.80 ms"),
];
const DEFAULT: &str = "default";
const STEP: &str = "6 faces, textures";
/// Steps are timed with this many cones.
const N_CONES: u32 = 1 << 16;

/// `quick`: pictures of a quarter of the side, half the cells along each axis, a sixteenth of the cones.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
    quick: bool,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let scene = with_light(scene);
    let options = settings!(GpuSceneOptions { rays: source, diffuse_only: false });
    let gpu_scene = GpuScene::new(gpu, &scene, options)?;
    let bench = Bench { gpu, scene: &gpu_scene, camera };
    let (picture, size, n_cones) = match quick {
        true => (PICTURE / 4, CELLS / 2, N_CONES / 16),
        false => (PICTURE, CELLS, N_CONES),
    };
    let ours =
        settings!(VoxelConeSettings { resolution: Resolution::Size(size), ..Default::default() });
    let cones = settings!(VoxelConeSettings {
        tracing: Tracing::Prefiltered,
        n_cones: 9,
        n_bounce_cones: 9,
        ..ours
    });
    let configurations = [
        (DEFAULT, ours),
        ("prefiltered", cones),
        ("one value a voxel", settings!(VoxelConeSettings { anisotropic: false, ..cones })),
        ("buffers", settings!(VoxelConeSettings { storage: PyramidStorage::Buffers, ..cones })),
        (
            "with diffuse occlusion",
            settings!(VoxelConeSettings { occludes_diffuse: true, ..cones }),
        ),
        ("16 cones", settings!(VoxelConeSettings { n_cones: 16, n_bounce_cones: 16, ..ours })),
    ];
    let mut rigs = vec![as_source(&bench, picture, size)?];
    for (_, settings) in configurations {
        let technique = VoxelCone::new(gpu, &gpu_scene, settings, camera.position)?;
        rigs.push(bench.rig(picture, technique)?);
    }
    let all = bench.run(&mut rigs, &MOVED)?;
    let mut rows = rows_of_source(&all[0]);
    let baseline = total(&all[1]);
    for ((name, _), passes) in configurations.iter().zip(&all[1..]) {
        for (pass, ms) in passes {
            rows.push(Row::new(format!("{name}: {pass}"), *ms, "ms"));
        }
        let ratio = (*name != DEFAULT).then_some((total(passes) / baseline, DEFAULT));
        rows.push(Row { ratio, ..Row::new(format!("{name}: total"), total(passes), "ms") });
    }
    let pyramids =
        [(STEP, 2), ("1 face, textures", 3), ("6 faces, buffers", 4), ("from surfel to surfel", 1)];
    let mut step = None;
    for (name, rig) in pyramids {
        let (ns, n_steps) = nanoseconds_per_step(gpu, &rigs[rig].technique, n_cones)?;
        let step = *step.get_or_insert(ns);
        let ratio = (name != STEP).then_some((ns / step, STEP));
        rows.push(Row { ratio, ..Row::new(format!("step of a cone, {name}"), ns, "ns") });
        rows.push(Row::new(format!("steps of a cone, {name}"), n_steps, ""));
    }
    Ok(rows)
}

fn total(passes: &Passes) -> f64 {
    passes.iter().map(|(_, ms)| ms).sum()
}

/// The source's settings (its bounce pass is one bounce a frame; PCSS for voxels and pixels).
fn as_source(bench: &Bench, picture: UVec2, size: UVec3) -> Result<Rig<VoxelCone>, Box<dyn Error>> {
    let Bench { gpu, scene, camera } = *bench;
    let settings = settings!(VoxelConeSettings {
        resolution: Resolution::Size(size),
        bounce_period: 1,
        tracing: Tracing::Prefiltered,
        n_cones: 9,
        n_bounce_cones: 9,
        stepping: ConeStepping { mip_bias: 0.0, ..ConeStepping::default() },
        face_weights: FaceWeights::Squared,
        specular: Specular::Fixed(10.0),
        ..Default::default()
    });
    let filtering = ShadowFiltering::Pcss { light_radius: 0.1, angular_radius: 0.27 };
    let maps =
        ShadowMaps::new(gpu, scene, settings!(ShadowSettings { filtering, ..Default::default() }))?;
    let visibility = maps.visibility();
    let eye = camera.position;
    let technique = VoxelCone::with_visibility(gpu, scene, settings, &visibility, eye)?;
    let mut rig = bench.rig(picture, technique)?;
    let direct = DirectSettings::default();
    rig.passes.direct = DirectPass::new(gpu, scene, picture, direct, &visibility);
    rig.passes.shadow_maps = Some(maps);
    Ok(rig)
}

fn rows_of_source(passes: &Passes) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut sum = 0.0;
    for (name, ours, theirs, baseline) in SOURCE {
        let ms = sum_of(passes, ours);
        sum += ms;
        let ratio = Some((ms / theirs, baseline));
        rows.push(Row { ratio, ..Row::new(format!("source's settings: {name}"), ms, "ms") });
    }
    let ratio = Some((sum / 14.32, "source's 14.32 ms (its parts: 15.62)"));
    rows.push(Row { ratio, ..Row::new("source's settings: sum", sum, "ms") });
    rows
}

/// Time of a step, and steps of a cone, for cones as wide as those in sets of 9. They start at evenly spread points of
/// the scene's box, in evenly spread directions.
fn nanoseconds_per_step(
    gpu: &Gpu,
    technique: &VoxelCone,
    n: u32,
) -> Result<(f64, f64), Box<dyn Error>> {
    let grid = technique.grid(0);
    let extent = grid.size.as_vec3() * grid.cell;
    // Additive recurrences that generalise the golden ratio's: low discrepancy in five dimensions.
    let shares = [0.811_521_4_f64, 0.658_567, 0.534_436, 0.433_706, 0.351_961];
    let cones: Vec<Cone> = (0..n)
        .map(|ix| {
            let u = shares.map(|share| (f64::from(ix) * share).fract() as f32);
            let (z, angle) = (2.0 * u[3] - 1.0, std::f32::consts::TAU * u[4]);
            let r = (1.0 - z * z).sqrt();
            Cone {
                origin: grid.origin + extent * Vec3::new(u[0], u[1], u[2]),
                spread: 0.516,
                direction: Vec3::new(r * angle.cos(), r * angle.sin(), z),
                max_distance: f32::MAX,
                normal: Vec3::ZERO,
                offset: 0.0,
            }
        })
        .collect();
    let cones = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("cones"),
        contents: bytemuck::cast_slice(&cones),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let results = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("cones met"),
        size: u64::from(n) * size_of::<ConeResult>() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let pass = match technique.pyramid() {
        Some(pyramid) => TracePass::new(gpu, pyramid),
        None => TracePass::of_surfels(gpu),
    };
    let mut timers = PassTimers::new(gpu).ok_or("this device has no timestamps")?;
    let mut best = f64::MAX;
    // The first round compiles.
    for round in 0..4 {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        timers.begin_frame();
        let (stepping, field) = (ConeStepping::default(), technique.field());
        {
            let recorder = &mut Recorder::timed(gpu, &mut encoder, Some(&mut timers));
            pass.record(recorder, field, &cones, &results, n, stepping, 0.0);
        }
        timers.resolve(&mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let bytes = read_buffer(gpu, timers.resolved())?;
        let ms: f64 = timers.milliseconds(&bytes).iter().map(|(_, ms)| ms).sum();
        if round > 0 {
            best = best.min(ms);
        }
    }
    let found: Vec<ConeResult> = bytemuck::pod_collect_to_vec(&read_buffer(gpu, &results)?);
    let n_steps: f64 = found.iter().map(|cone| f64::from(cone.n_steps)).sum();
    Ok((1e6 * best / n_steps, n_steps / f64::from(n)))
}
