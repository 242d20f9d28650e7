// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna render` and `lucerna reference`.

pub mod fit_lights;
mod realtime;
pub mod settings;

use super::CommandResult;
use super::progress::Meter;
use super::scene_args::{
    AdapterArguments, ObjectArguments, Prepared, SceneArguments, ViewArguments,
};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use glam::UVec2;
use lucerna::blocking::{LostGpu, read_stat, render_reference};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::picture::{PngOptions, ToneMap, check_whole_file, write_whole_file};
use lucerna::scene::{Camera, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, PixelSums, ReferenceSettings, resolve};
use lucerna::techniques::{Stat, TECHNIQUES};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Where the picture goes and what it shows.
#[derive(Args, Clone, Debug)]
pub struct OutputArguments {
    /// Output picture: .png (display values), .exr or .hdr (linear).
    #[arg(short, long, value_name = "FILE", value_parser = parse_output)]
    output: PathBuf,
    /// What the picture shows.
    #[arg(long, value_enum, default_value_t = ChannelArgument::Beauty)]
    channel: ChannelArgument,
    /// Brighten a PNG by this many stops (negative: darken).
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
    /// Compress a PNG's highlights (Khronos PBR Neutral) instead of clipping them.
    #[arg(long)]
    tone_map: bool,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Radius of ambient occlusion [m] (for `--channel openness`).
    #[arg(long, value_name = "M", default_value_t = 1.0, value_parser = parse_occlusion_distance)]
    occlusion_distance: f32,
    /// Write GPU times per pass as JSON.
    #[arg(long, value_name = "FILE.json")]
    timings: Option<PathBuf>,
}

pub fn parse_output(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|ending| ending.to_str()).map(str::to_lowercase).as_deref() {
        Some("png" | "exr" | "hdr") => Ok(path),
        _ => Err("the ending must be .png, .exr or .hdr".into()),
    }
}

fn parse_occlusion_distance(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(distance) if (1e-6..=1e9).contains(&distance) => Ok(distance),
        _ => Err("expected metres between 1e-6 and 1e9".into()),
    }
}

fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.abs() <= 64.0 => Ok(stops),
        _ => Err("expected a number of stops between -64 and 64".into()),
    }
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq)]
enum ChannelArgument {
    /// Emitted, direct and indirect light.
    Beauty,
    /// Light seen directly from emitters and the sky.
    Emitted,
    /// Light reflected once.
    Direct,
    /// Light reflected more than once.
    Indirect,
    /// Irradiance at the first surface [W/m²].
    Irradiance,
    /// Base colour of the first surface.
    Albedo,
    /// World-space normal of the first surface (PNG: 0.5 + 0.5·n).
    Normal,
    /// Distance along the view axis [m] (PNG: nearest white, farthest black).
    Depth,
    /// Ambient occlusion: the share of the hemisphere that is open within --occlusion-distance (only techniques
    /// `reference` and `voxel-cone`).
    Openness,
}

impl From<ChannelArgument> for Channel {
    fn from(channel: ChannelArgument) -> Self {
        match channel {
            ChannelArgument::Beauty => Self::Beauty,
            ChannelArgument::Emitted => Self::Emitted,
            ChannelArgument::Direct => Self::Direct,
            ChannelArgument::Indirect => Self::Indirect,
            ChannelArgument::Irradiance => Self::Irradiance,
            ChannelArgument::Albedo => Self::Albedo,
            ChannelArgument::Normal => Self::Normal,
            ChannelArgument::Depth => Self::Depth,
            ChannelArgument::Openness => Self::Openness,
        }
    }
}

/// Reflections after the first that the reference follows by default.
const REFERENCE_BOUNCES: u32 = 16;

/// `lucerna render`.
#[derive(Args, Clone, Debug)]
pub struct RenderArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    objects: ObjectArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// How light is computed.
    #[arg(long, value_name = "TECHNIQUE", default_value = REFERENCE, value_parser = technique_parser())]
    technique: String,
    /// Frames to accumulate, each with its own sample positions within the pixels. The reference takes one sample per
    /// pixel and frame.
    #[arg(long, default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: u32,
    /// Reflections after the first; 0: direct light only. [default: 16 for the reference; unlimited for `voxel-rt` and
    /// `voxel-cone`, where a limit makes each bounce cost as much as the first]
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=1000))]
    bounces: Option<u32>,
    #[command(flatten)]
    realtime: realtime::RealtimeArguments,
    #[command(flatten)]
    settings: settings::SettingArguments,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    adapter: AdapterArguments,
}

const REFERENCE: &str = "reference";

/// The names of all techniques.
fn technique_parser() -> PossibleValuesParser {
    let reference = PossibleValue::new(REFERENCE).help("Unidirectional path tracer");
    let others = TECHNIQUES.iter().map(|of| PossibleValue::new(of.name).help(of.help));
    PossibleValuesParser::new([reference].into_iter().chain(others))
}

/// `lucerna reference`.
#[derive(Args, Clone, Debug)]
pub struct ReferenceArguments {
    #[command(flatten)]
    scene: SceneArguments,
    #[command(flatten)]
    objects: ObjectArguments,
    #[command(flatten)]
    view: ViewArguments,
    /// Samples per pixel.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    spp: u32,
    /// Reflections after the first; 0: direct light only.
    #[arg(long, default_value_t = REFERENCE_BOUNCES, value_parser = clap::value_parser!(u32).range(0..=1000))]
    bounces: u32,
    #[command(flatten)]
    output: OutputArguments,
    #[command(flatten)]
    adapter: AdapterArguments,
}

pub fn render(arguments: &RenderArguments) -> CommandResult {
    if let Some(technique) = TECHNIQUES.iter().find(|of| of.name == arguments.technique) {
        return realtime::render(arguments, technique);
    }
    if let Some(name) = arguments.settings.first() {
        return Err(format!("--{name} is not a setting of the technique {REFERENCE}").into());
    }
    if let Some(name) = arguments.realtime.not_of_reference() {
        return Err(format!("--{name} means nothing to the technique {REFERENCE}").into());
    }
    trace(
        (&arguments.scene, &arguments.objects, &arguments.view),
        &arguments.adapter,
        &arguments.output,
        arguments.frames,
        arguments.bounces.unwrap_or(REFERENCE_BOUNCES),
    )
}

pub fn reference(arguments: &ReferenceArguments) -> CommandResult {
    trace(
        (&arguments.scene, &arguments.objects, &arguments.view),
        &arguments.adapter,
        &arguments.output,
        arguments.spp,
        arguments.bounces,
    )
}

fn trace(
    scene: (&SceneArguments, &ObjectArguments, &ViewArguments),
    adapter: &AdapterArguments,
    output: &OutputArguments,
    n_samples: u32,
    n_bounces: u32,
) -> CommandResult {
    let Ready { camera, size, gpu, info, rays, gpu_scene, .. } = prepare(scene, adapter, output)?;
    let settings = settings!(ReferenceSettings {
        size,
        n_bounces,
        seed: output.seed,
        irradiance: output.channel == ChannelArgument::Irradiance,
        occlusion_distance: if output.channel == ChannelArgument::Openness {
            output.occlusion_distance
        } else {
            0.0
        },
    });

    let interrupted = interrupt_flag()?;
    if info.device_type == wgpu::DeviceType::Cpu {
        eprintln!(
            "compiling reference/path_trace (takes some seconds; the driver caches it for next time)"
        );
    }
    let mut meter = Meter::new("path tracing");
    let (sums, stats) =
        render_reference(&gpu, &gpu_scene, &camera, &settings, n_samples, |progress| {
            meter.show(progress.done, progress.total);
            !interrupted.load(Ordering::Relaxed)
        })?;
    meter.finish();
    let rejected: u64 = sums.iter().map(|pixel| u64::from(pixel.n_rejected)).sum();
    let n_cut = u64::from(stats.n_cut);
    if n_cut > 0 {
        errln!(
            "warning: {n_cut} of {} samples were abandoned and their light is missing: a ray needed more steps than this driver allows in a loop (65535)",
            u64::from(stats.n_samples) * u64::from(size.x) * u64::from(size.y)
        );
    }
    let rejected = rejected.saturating_sub(n_cut);
    if rejected > 0 {
        errln!("warning: {rejected} samples were not finite and were left out");
    }
    write_picture(&sums, size, output, output.channel)?;
    if let Some(file) = &output.timings {
        let pass = serde_json::json!({
            "name": "reference/path_trace",
            "dispatches": stats.n_dispatches,
            "dispatches_continued": stats.n_continued,
            "gpu_ms": stats.gpu_time.map(|time| time.as_secs_f64() * 1e3),
        });
        let count = ("samples_per_pixel", stats.n_samples);
        write_timings(file, &info, rays, count, stats.wall_time, vec![pass], &[])?;
    }
    if stats.stopped {
        errln!(
            "stopped: every pixel has {} of {n_samples} samples, and some have one batch more",
            stats.n_samples
        );
    }
    errln!("rendered in {:.2} s", stats.wall_time.as_secs_f64());
    outln!("{}", output.output.display())?;
    Ok(())
}

/// What every technique starts with.
struct Ready {
    camera: Camera,
    size: UVec2,
    gpu: Gpu,
    info: wgpu::AdapterInfo,
    rays: RaySource,
    gpu_scene: GpuScene,
    /// Without the objects that were placed in it.
    scene: Scene,
}

/// Loads the scene, opens the device and uploads the scene to it.
fn prepare(
    (scene, objects, view): (&SceneArguments, &ObjectArguments, &ViewArguments),
    adapter: &AdapterArguments,
    output: &OutputArguments,
) -> Result<Ready, Box<dyn std::error::Error>> {
    // A long rendering must not fail at the end because a folder does not exist.
    check_writable(&output.output)?;
    if let Some(file) = &output.timings {
        check_writable(file)?;
    }
    let diffuse_only = scene.diffuse;
    let Prepared { scene, camera, size } = scene.prepare(view)?;
    let (gpu, info, rays) = adapter.open()?;
    let gpu_scene = if objects.is_given() {
        let mut whole = scene.clone();
        objects.place_in(&mut whole)?;
        let moving = scene.instances.len()..;
        upload_with(&gpu, &whole, diffuse_only, rays, &|instance| moving.contains(&instance))?
    } else {
        upload(&gpu, &scene, diffuse_only, rays)?
    };
    Ok(Ready { camera, size, gpu, info, rays, gpu_scene, scene })
}

/// Uploads a scene, and says what it has.
pub fn upload(
    gpu: &Gpu,
    scene: &Scene,
    diffuse_only: bool,
    rays: RaySource,
) -> Result<GpuScene, Box<dyn std::error::Error>> {
    upload_with(gpu, scene, diffuse_only, rays, &|_| false)
}

/// As [`upload`]; `moving`: which instances move.
fn upload_with(
    gpu: &Gpu,
    scene: &Scene,
    diffuse_only: bool,
    rays: RaySource,
    moving: &dyn Fn(usize) -> bool,
) -> Result<GpuScene, Box<dyn std::error::Error>> {
    let options = settings!(GpuSceneOptions { diffuse_only, rays });
    let gpu_scene = GpuScene::with_moving(gpu, scene, options, moving)?;
    if gpu_scene.skipped_triangles() > 0 {
        errln!(
            "warning: {} triangles have no area or are too far away, and are left out",
            gpu_scene.skipped_triangles()
        );
    }
    let n_lights = gpu_scene.n_lights();
    let lights = if n_lights == 1 { "light" } else { "lights" };
    errln!("scene: {} triangles, {n_lights} {lights}", gpu_scene.n_triangles());
    Ok(gpu_scene)
}

/// Reads statistics, those with the same name (one per level) added up, and warns of those that should be 0.
pub fn warn_of_faults(
    gpu: &Gpu,
    stats: impl IntoIterator<Item = Stat>,
) -> Result<Vec<(Stat, u64)>, LostGpu> {
    let mut out: Vec<(Stat, u64)> = Vec::new();
    for stat in stats {
        let number = read_stat(gpu, &stat)?;
        match out.iter_mut().find(|(known, _)| known.name == stat.name) {
            Some((_, sum)) => *sum += number,
            None => out.push((stat, number)),
        }
    }
    for (stat, number) in &out {
        if let Some(advice) = stat.fault.filter(|_| *number > 0) {
            errln!("warning: {}: {number} {}; {advice}", stat.name, stat.unit);
        }
    }
    Ok(out)
}

/// Set by Ctrl-C. The second one ends the program at once.
pub fn interrupt_flag() -> Result<Arc<AtomicBool>, ctrlc::Error> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    })?;
    Ok(interrupted)
}

/// Writes the requested channel to the output file.
fn write_picture(
    sums: &[PixelSums],
    size: UVec2,
    output: &OutputArguments,
    channel: ChannelArgument,
) -> CommandResult {
    let picture = resolve(sums, size, channel.into());
    let picture = for_file(picture, output);
    let tone_map = output.tone_map.then_some(ToneMap::KhronosPbrNeutral);
    picture
        .write(&output.output, &settings!(PngOptions { exposure_ev: output.exposure, tone_map }))?;
    Ok(())
}

/// Maps normals and depths into a PNG's range 0..1.
fn for_file(
    mut picture: lucerna::picture::Picture,
    output: &OutputArguments,
) -> lucerna::picture::Picture {
    let png = output.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    match output.channel {
        ChannelArgument::Normal if png => {
            for rgb in &mut picture.rgb {
                *rgb = *rgb * 0.5 + 0.5;
            }
        }
        ChannelArgument::Depth if png => {
            let depths = || picture.rgb.iter().map(|rgb| rgb.x).filter(|&depth| depth > 0.0);
            let (near, far) = (depths().fold(f32::MAX, f32::min), depths().fold(0.0, f32::max));
            let span = (far - near).max(1e-6);
            for rgb in &mut picture.rgb {
                let shade = if rgb.x > 0.0 { 1.0 - 0.9 * (rgb.x - near) / span } else { 0.0 };
                *rgb = glam::Vec3::splat(shade);
            }
        }
        _ => {}
    }
    picture
}

/// Fails early if the output cannot be written.
pub fn check_writable(output: &Path) -> CommandResult {
    check_whole_file(output)
        .map_err(|error| format!("cannot write {}: {error}", output.display()))?;
    Ok(())
}

fn write_timings(
    file: &Path,
    info: &wgpu::AdapterInfo,
    rays: RaySource,
    (counted, count): (&str, u32),
    wall_time: Duration,
    passes: Vec<serde_json::Value>,
    stats: &[(Stat, u64)],
) -> CommandResult {
    let stats: Vec<_> = stats
        .iter()
        .map(|(stat, number)| {
            serde_json::json!({ "name": stat.name, "unit": stat.unit, "number": number })
        })
        .collect();
    let json = serde_json::json!({
        "adapter": info.name,
        "backend": info.backend.to_string(),
        "driver": info.driver_info,
        "rays": match rays { RaySource::Software => "software", RaySource::RayQuery => "ray_query" },
        counted: count,
        "wall_ms": wall_time.as_secs_f64() * 1e3,
        "passes": passes,
        "stats": stats,
    });
    let text = serde_json::to_string_pretty(&json)?;
    write_whole_file(file, |writer| -> std::io::Result<()> { writeln!(writer, "{text}") })
        .map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    Ok(())
}
