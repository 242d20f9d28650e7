//! `voxel-rt` pass by pass: beside its source's configuration, and how cost goes with rays and pixels.

use super::Row;
use glam::{UVec2, Vec3};
use lucerna::blocking::read_buffer;
use lucerna::frame::{Frame, GBuffer, GBufferPass, PassTimers, Technique, View, ViewSettings};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource, WorldTriangles};
use lucerna::scene::{Camera, Light, Scene};
use lucerna::voxel_rt::{
    Bounces, Change, DirectLight, Lookup, RaysInjected, VoxelRt, VoxelRtSettings, WriteStrategy,
};
use std::error::Error;

/// The source's picture, cells along the longest side, and rays along a side of the light's square.
const PICTURE: UVec2 = UVec2::new(1920, 1080);
const CELLS: u32 = 128;
const RAYS: u32 = 512;
/// The fastest of so many frames counts.
const ROUNDS: u32 = 5;
/// Frames until faces that are dark are seldom asked any more.
const FRAMES_TO_SETTLE: u32 = 24;
const BASELINE: &str = "store, 1 bounce";
const VOXELIZE: [&str; 2] = ["voxel/voxelize", "voxel_rt/carry"];

/// `quick`: pictures of a quarter of the side, and half the cells and rays.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
    quick: bool,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let scene = with_light(scene);
    let options = GpuSceneOptions { rays: source, diffuse_only: true };
    let gpu_scene = GpuScene::new(gpu, &scene, options)?;
    let bench = Bench { gpu, scene: &gpu_scene, camera };
    let (picture, cells, n_rays) =
        if quick { (PICTURE / 4, CELLS / 2, RAYS / 2) } else { (PICTURE, CELLS, RAYS) };
    let from_lights = |strategy| DirectLight::FromLights(RaysInjected { n_rays, strategy });
    let ours = VoxelRtSettings { resolution: cells, ..Default::default() };
    let sources = VoxelRtSettings {
        anisotropic: false,
        direct: from_lights(WriteStrategy::Store),
        bounces: Bounces::UpTo(1),
        lookup: Lookup::SevenTap,
        ..ours
    };
    let configurations = [
        (BASELINE, sources),
        (
            "moving average, 1 bounce",
            VoxelRtSettings { direct: from_lights(WriteStrategy::MovingAverage), ..sources },
        ),
        (
            "exact, 1 bounce",
            VoxelRtSettings { direct: from_lights(WriteStrategy::Exact), ..sources },
        ),
        (
            "exact, 6 faces, all bounces",
            VoxelRtSettings { direct: from_lights(WriteStrategy::Exact), ..ours },
        ),
        ("default", ours),
    ];
    let mut rows = Vec::new();
    let mut baseline = None;
    let all = bench.passes(&configurations.map(|(_, settings)| (picture, settings)))?;
    for ((name, _), passes) in configurations.iter().zip(all) {
        let total: f64 = passes.iter().map(|(_, ms)| ms).sum();
        let baseline = *baseline.get_or_insert(total);
        for (pass, ms) in passes {
            rows.push(row(format!("{name}: {pass}"), ms, "ms"));
        }
        let ratio = (*name != BASELINE).then_some((total / baseline, BASELINE));
        rows.push(Row { ratio, ..row(format!("{name}: total"), total, "ms") });
    }
    // Shading by pixels whatever the rays, and injection by rays whatever the pixels.
    let sizes = [
        (picture / 4, n_rays),
        (picture / 2, n_rays),
        (picture, n_rays),
        (picture / 2, n_rays / 2),
        (picture / 2, 2 * n_rays),
    ];
    let injected = |n_rays| VoxelRtSettings {
        direct: DirectLight::FromLights(RaysInjected { n_rays, strategy: WriteStrategy::Exact }),
        ..ours
    };
    let all = bench.passes(&sizes.map(|(size, n_rays)| (size, injected(n_rays))))?;
    for ((size, n_rays), passes) in sizes.into_iter().zip(all) {
        let of = |name| passes.iter().find(|(pass, _)| *pass == name).map_or(0.0, |(_, ms)| *ms);
        let name = format!("{} x {}, {n_rays}^2 rays", size.x, size.y);
        let (n_pixels, n_rays) = (f64::from(size.element_product()), f64::from(n_rays).powi(2));
        rows.push(row(format!("{name}: shade"), 1e6 * of("voxel_rt/shade") / n_pixels, "ns/pixel"));
        rows.push(row(format!("{name}: inject"), 1e6 * of("voxel_rt/inject") / n_rays, "ns/ray"));
    }
    Ok(rows)
}

/// A scene without any light gets a point light in the middle of its box.
fn with_light(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if scene.lights.is_empty() && scene.materials.iter().all(|m| m.emission == Vec3::ZERO) {
        let (low, high) = WorldTriangles::of(&scene).bounds();
        let intensity = Vec3::splat((high - low).length_squared());
        scene.lights.push(Light::Point { position: 0.5 * (low + high), intensity, range: None });
    }
    scene
}

fn row(name: String, value: f64, unit: &'static str) -> Row {
    Row { name, value, unit, ratio: None }
}

struct Bench<'a> {
    gpu: &'a Gpu,
    scene: &'a GpuScene,
    camera: &'a Camera,
}

/// Fastest time of passes \[ms\].
type Passes = Vec<(&'static str, f64)>;

/// One configuration under way.
struct Rig {
    technique: VoxelRt,
    gbuffer: GBuffer,
    view: View,
    best: Passes,
}

impl Bench<'_> {
    /// Of each configuration the technique's passes: voxelizing and carrying from frames in which everything
    /// moved, the others from frames in which nothing did. The configurations take turns, so that a
    /// disturbance meets all of them.
    fn passes(
        &self,
        configurations: &[(UVec2, VoxelRtSettings)],
    ) -> Result<Vec<Passes>, Box<dyn Error>> {
        let mut timers = PassTimers::new(self.gpu)
            .ok_or("this device has no timestamps: passes can't be timed")?;
        let mut gbuffer_pass = GBufferPass::new(self.gpu, self.scene);
        let mut rigs = Vec::new();
        for &(size, settings) in configurations {
            rigs.push(Rig {
                technique: VoxelRt::new(self.gpu, self.scene, settings, self.camera.position)?,
                gbuffer: GBuffer::new(self.gpu, size)?,
                view: View::new(self.gpu, size),
                best: Vec::new(),
            });
        }
        for frame_ix in 0..1 + ROUNDS + FRAMES_TO_SETTLE + ROUNDS {
            for rig in &mut rigs {
                self.frame(rig, frame_ix, &mut timers, &mut gbuffer_pass)?;
            }
        }
        Ok(rigs.into_iter().map(|rig| rig.best).collect())
    }

    fn frame(
        &self,
        rig: &mut Rig,
        frame_ix: u32,
        timers: &mut PassTimers,
        gbuffer_pass: &mut GBufferPass,
    ) -> Result<(), Box<dyn Error>> {
        // The first frame compiles.
        let is_moved = frame_ix <= ROUNDS;
        let is_settled = frame_ix > ROUNDS + FRAMES_TO_SETTLE;
        if is_moved {
            rig.technique.changed(Change::Geometry);
        }
        let settings = ViewSettings::default();
        rig.view.advance(self.gpu, self.scene, self.camera, &settings);
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        timers.begin_frame();
        let frame = &mut Frame {
            gpu: self.gpu,
            encoder: &mut encoder,
            scene: self.scene,
            view: &rig.view,
            timers: Some(timers),
        };
        rig.technique.update(frame)?;
        if frame_ix == 0 || is_settled {
            gbuffer_pass.record(frame, &rig.gbuffer);
            rig.technique.shade(frame, &rig.gbuffer);
        }
        timers.resolve(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let bytes = read_buffer(self.gpu, timers.resolved())?;
        let counts = |name: &str| match VOXELIZE.contains(&name) {
            true => is_moved && frame_ix > 0,
            false => is_settled && name.starts_with("voxel"),
        };
        for (name, ms) in timers.milliseconds(&bytes).into_iter().filter(|(name, _)| counts(name)) {
            match rig.best.iter_mut().find(|(known, _)| *known == name) {
                Some((_, least)) => *least = least.min(ms),
                None => rig.best.push((name, ms)),
            }
        }
        Ok(())
    }
}
