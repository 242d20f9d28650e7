//! `lucerna render --technique …` for techniques that render frames.

use super::{
    ChannelArgument, Ready, RenderArguments, interrupt_flag, prepare, write_picture, write_timings,
};
use crate::cli::CommandResult;
use crate::cli::progress::Meter;
use clap::Args;
use lucerna::blocking::{FramesToRender, read_film, render_frames};
use lucerna::frame::{DirectSettings, Technique, ViewSettings};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::Camera;
use std::error::Error;
use std::sync::atomic::Ordering;

/// What only techniques that render frames look at.
#[derive(Args, Clone, Debug)]
pub struct RealtimeArguments {
    /// Rays to emissive surfaces and the sky, per pixel and frame (not for the reference).
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=1024))]
    light_samples: u32,
    /// Distance in front of the camera from which surfaces are seen [m] (not for the reference).
    #[arg(long, value_name = "M", default_value_t = 0.01, value_parser = parse_near)]
    near: f32,
    /// Frames in which a technique learns before the first one that is accumulated.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    warm_up: u32,
}

fn parse_near(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(near) if (1e-6..=1e6).contains(&near) => Ok(near),
        _ => Err("expected metres between 1e-6 and 1e6".into()),
    }
}

/// Renders the frames with the technique that `make` returns, and writes what was asked for.
///
/// `warn`: says what the technique had to leave out.
pub fn render<T: Technique>(
    arguments: &RenderArguments,
    make: impl FnOnce(&Gpu, &GpuScene, &Camera) -> Result<T, Box<dyn Error>>,
    warn: impl FnOnce(&Gpu, &T) -> CommandResult,
) -> CommandResult {
    let output = &arguments.output;
    let Ready { camera, size, gpu, info, rays, gpu_scene } =
        prepare(&arguments.scene, &arguments.adapter, output)?;
    let mut technique = make(&gpu, &gpu_scene, &camera)?;
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
            ..DirectSettings::default()
        },
        n_warm_up: arguments.realtime.warm_up,
        timed: output.timings.is_some(),
    };
    let interrupted = interrupt_flag()?;
    if info.device_type == wgpu::DeviceType::Cpu {
        errln!("compiling the kernels (some seconds; the driver keeps them for next time)");
    }
    let mut meter = Meter::new("rendering");
    let (passes, stats) =
        render_frames(&gpu, &gpu_scene, &camera, &what, &mut technique, |progress| {
            meter.show(progress.done, progress.total);
            !interrupted.load(Ordering::Relaxed)
        })?;
    meter.finish();
    let sums = read_film(&gpu, passes.accumulator.film())?;
    let left_out: u64 = sums.iter().map(|pixel| u64::from(pixel.n_rejected)).sum();
    if left_out + u64::from(stats.n_rejected) > 0 {
        errln!(
            "warning: light was not finite: {} times direct light was replaced by 0, {left_out} times a pixel of a frame was left out",
            stats.n_rejected
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
