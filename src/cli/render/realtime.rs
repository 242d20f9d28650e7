//! `lucerna render --technique …` for techniques that render frames.

use super::{
    ChannelArgument, Ready, RenderArguments, interrupt_flag, prepare, write_picture, write_timings,
};
use crate::cli::CommandResult;
use crate::cli::progress::Meter;
use clap::Args;
use lucerna::blocking::{FramesToRender, Progress, read_film, render_frames_with};
use lucerna::frame::{DirectPass, DirectSettings, FramePasses, Technique, ViewSettings};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::Camera;
use lucerna::shadow::{ShadowBinding, ShadowError, ShadowFiltering, ShadowMaps, ShadowSettings};
use std::error::Error;
use std::sync::atomic::Ordering;

/// What only techniques that render frames look at.
#[derive(Args, Clone, Debug)]
pub struct RealtimeArguments {
    /// Rays to emissive surfaces and the sky, per pixel and frame (not for the reference).
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=1024))]
    light_samples: u32,
    /// Distance in front of the camera from which surfaces are seen [m] (not for the reference). [default: 1e-5, or
    /// 1e-4 of the scene's diagonal if that is less]
    #[arg(long, value_name = "M", value_parser = parse_near)]
    near: Option<f32>,
    /// Frames in which a technique learns before the first one that is accumulated.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    warm_up: u32,
    /// What tells whether a surface sees a light (not for the reference).
    #[arg(long, value_enum, default_value_t = ShadowArgument::Rays)]
    shadows: ShadowArgument,
    /// With `--shadows pcf` or `pcss`: texels along a shadow map's side.
    #[arg(long, value_name = "TEXELS", default_value_t = ShadowSettings::default().resolution, value_parser = clap::value_parser!(u32).range(16..=16384))]
    shadow_size: u32,
    /// With `--shadows pcss`: radius of point and spot lights [m].
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = parse_radius)]
    light_radius: f32,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq)]
enum ShadowArgument {
    /// Rays.
    Rays,
    /// Shadow maps of point, spot and directional lights, percentage-closer filtering; rays for others. Of
    /// `voxel-cone`, the voxels' light too.
    Pcf,
    /// The same with percentage-closer soft shadows.
    Pcss,
    /// Cones through the voxels (of `voxel-cone`): soft, without noise, and blind to what is smaller than
    /// a voxel.
    Cones,
}

impl RealtimeArguments {
    /// How shadow maps are filtered; None: there are none.
    fn filtering(&self) -> Option<ShadowFiltering> {
        match self.shadows {
            ShadowArgument::Rays | ShadowArgument::Cones => None,
            ShadowArgument::Pcf => Some(ShadowSettings::default().filtering),
            ShadowArgument::Pcss => Some(ShadowFiltering::Pcss {
                light_radius: self.light_radius,
                angular_radius: SUN_RADIUS,
            }),
        }
    }
}

/// Angular radius of the sun [degrees].
const SUN_RADIUS: f32 = 0.27;

fn parse_radius(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(radius) if (0.0..=1e6).contains(&radius) => Ok(radius),
        _ => Err("expected metres between 0 and 1e6".into()),
    }
}

fn parse_near(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(near) if (1e-12..=1e6).contains(&near) => Ok(near),
        _ => Err("expected metres between 1e-12 and 1e6".into()),
    }
}

/// Makes the shadows that a technique's cones cast.
type ConeShadows<T> = fn(&Gpu, &T) -> Result<ShadowBinding, ShadowError>;

/// Renders the frames with the technique that `make` returns, and writes what was asked for.
///
/// `make`: of the scene, the camera, and shadow maps where those were asked for. `cone_shadows`: of techniques that
/// have them. `warn`: says what the technique had to leave out.
pub fn render<T: Technique>(
    arguments: &RenderArguments,
    make: impl FnOnce(&Gpu, &GpuScene, &Camera, Option<&ShadowMaps>) -> Result<T, Box<dyn Error>>,
    cone_shadows: Option<ConeShadows<T>>,
    warn: impl FnOnce(&Gpu, &T) -> CommandResult,
) -> CommandResult {
    let output = &arguments.output;
    let shadows = arguments.realtime.shadows;
    if shadows == ShadowArgument::Cones && cone_shadows.is_none() {
        return Err("--shadows cones needs --technique voxel-cone".into());
    }
    // Kernels with other shadows ask rays in software alone.
    let software_rays = shadows != ShadowArgument::Rays;
    let Ready { camera, size, gpu, info, rays, gpu_scene } =
        prepare(&arguments.scene, &arguments.adapter, output, software_rays)?;
    let maps = match arguments.realtime.filtering() {
        Some(filtering) => {
            let settings = ShadowSettings { resolution: arguments.realtime.shadow_size, filtering };
            Some(ShadowMaps::new(&gpu, &gpu_scene, settings)?)
        }
        None => None,
    };
    let mut technique = make(&gpu, &gpu_scene, &camera, maps.as_ref())?;
    let binding = match (&maps, cone_shadows) {
        (Some(maps), _) => Some(maps.binding(&gpu)),
        (None, Some(of)) if shadows == ShadowArgument::Cones => Some(of(&gpu, &technique)?),
        _ => None,
    };
    let what = FramesToRender {
        size,
        view: ViewSettings {
            n_accumulated: arguments.frames,
            seed: output.seed,
            near: arguments.realtime.near,
            irradiance: output.channel == ChannelArgument::Irradiance,
            occlusion_distance: output.occlusion_distance,
        },
        direct: DirectSettings {
            n_samples: arguments.realtime.light_samples,
            // What cones find they find by drawing lights.
            n_bsdf_samples: if shadows == ShadowArgument::Cones {
                0
            } else {
                DirectSettings::default().n_bsdf_samples
            },
        },
        n_warm_up: arguments.realtime.warm_up,
        timed: output.timings.is_some(),
    };
    let interrupted = interrupt_flag()?;
    if info.device_type == wgpu::DeviceType::Cpu {
        errln!("compiling the kernels (some seconds; the driver keeps them for next time)");
    }
    let mut meter = Meter::new("rendering");
    let mut passes = FramePasses::new(&gpu, &gpu_scene, size, what.direct)?;
    if let Some(binding) = &binding {
        passes.direct = DirectPass::with_shadows(&gpu, &gpu_scene, size, what.direct, binding)?;
    }
    passes.shadow_maps = maps;
    let keep_going = |progress: Progress| {
        meter.show(progress.done, progress.total);
        !interrupted.load(Ordering::Relaxed)
    };
    let (passes, stats) =
        render_frames_with(&gpu, &gpu_scene, &camera, &what, &mut technique, passes, keep_going)?;
    meter.finish();
    let sums = read_film(&gpu, passes.accumulator.film())?;
    let left_out: u64 = sums.iter().map(|pixel| u64::from(pixel.n_rejected)).sum();
    if left_out + u64::from(stats.n_rejected) > 0 {
        errln!(
            "warning: light was not finite, or its cones took more steps than the driver lets a loop take: {} times direct light was replaced by 0, {left_out} times a pixel of a frame was left out",
            stats.n_rejected
        );
    }
    if stats.n_cut > 0 {
        errln!(
            "warning: direct light of {} pixels (of {} frames together) is wrong: this driver ends loops after 65535 iterations; use fewer --light-samples",
            stats.n_cut,
            stats.n_frames
        );
    }
    warn(&gpu, &technique)?;
    write_picture(&sums, size, output)?;
    if let Some(file) = &output.timings {
        let passes = stats.passes.iter().map(|(name, time)| {
            let gpu_ms = time.as_secs_f64() * 1e3;
            serde_json::json!({
                "name": name,
                "gpu_ms": gpu_ms,
                "gpu_ms_per_frame": gpu_ms / f64::from(stats.n_frames),
            })
        });
        let count = ("frames", stats.n_frames);
        write_timings(file, &info, rays, count, stats.wall_time, passes.collect())?;
    }
    if stats.stopped {
        errln!("stopped: {} of {} frames", stats.n_frames, arguments.frames);
    }
    errln!("rendered in {:.2} s", stats.wall_time.as_secs_f64());
    outln!("{}", output.output.display())?;
    Ok(())
}
