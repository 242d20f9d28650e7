// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna render --technique …` for techniques that render frames.

use super::{
    ChannelArgument, Ready, RenderArguments, interrupt_flag, prepare, warn_of_faults,
    write_picture, write_timings,
};
use crate::CommandResult;
use crate::net_args::NetArguments;
use crate::progress::Meter;
use crate::render::settings::{BAKED, BAKES, NEEDS_BAKE};
use clap::Args;
use lucerna::blocking::{FrameStats, FramesToRender, Progress, read_film, render_frames_with};
use lucerna::components::LightVisibility;
use lucerna::components::probes::{BakeError, ProbeFile};
use lucerna::components::shadow_maps::{ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::frame::{DirectSettings, FramePasses, ViewSettings};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{N_SKY_PARTS, Scene, SceneFingerprint, Sky, sky_part_weights};
use lucerna::settings;
use lucerna::techniques::probe_volume::{ProbeVolume, ProbeVolumeSettings};
use lucerna::techniques::reference::PixelSums;
use lucerna::techniques::{Settings, Stat, Technique, TechniqueEntry};
use std::sync::atomic::{AtomicBool, Ordering};

/// Arguments that only techniques that render frames use.
#[derive(Args, Clone, Debug)]
pub struct RealtimeArguments {
    /// Rays to emissive surfaces and the sky, per pixel and frame (not for the reference).
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(0..=1024))]
    light_samples: u32,
    /// Distance to the near plane [m]: surfaces closer to the camera are not seen (not for the reference). [default:
    /// 1e-5, or 1e-4 of the scene's diagonal if that is less]
    #[arg(long, value_name = "M", value_parser = parse_near)]
    near: Option<f32>,
    /// Frames in which the technique gathers light before the first accumulated frame, at most: see --settled.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(0..=1_000_000))]
    warm_up: u32,
    /// End the warm-up once less than this of the technique's light is still on its way; 0: never.
    #[arg(long, value_name = "PERCENT", default_value_t = 0.5, value_parser = parse_percent)]
    settled: f32,
    /// How to decide whether a surface sees a light (not for the reference).
    #[arg(long, value_enum, default_value_t = ShadowArgument::Rays)]
    shadows: ShadowArgument,
    /// With `--shadows pcf` or `pcss`: texels along each side of a shadow map.
    #[arg(long, value_name = "TEXELS", default_value_t = ShadowSettings::default().resolution, value_parser = clap::value_parser!(u32).range(16..=16384))]
    shadow_size: u32,
    /// Show a debug view of the technique instead of its light (voxel-rt: irradiance, cells, levels).
    #[arg(long, value_name = "NAME")]
    debug_view: Option<String>,
    /// Use the light of a file that `lucerna bake` wrote. Repeatable, for files with the same probes, whose light is added up: FILE=0.5 is half
    /// of its light (only `probe-volume`).
    #[arg(long, value_name = "FILE[=WEIGHT]", value_parser = parse_bake)]
    bake: Vec<BakeChoice>,
    /// With one `--bake` that was made with `--sky-parts`: add the light of this scene's sky, whatever it is now.
    #[arg(long, requires = "bake", conflicts_with = "bake_memory")]
    bake_sky: bool,
    /// With one `--bake`: load only the probes nearest to the camera, as many as this many megabytes of GPU memory have room for.
    #[arg(long, value_name = "MB", requires = "bake", value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    bake_memory: Option<u32>,
    #[command(flatten)]
    net: NetArguments,
    /// With `--shadows pcss`: radius of point and spot lights [m].
    #[arg(long, value_name = "M", default_value_t = 0.1, value_parser = parse_radius)]
    light_radius: f32,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq)]
enum ShadowArgument {
    /// Rays.
    Rays,
    /// Shadow maps with percentage-closer filtering for point, spot and directional lights; rays for others. With
    /// `voxel-cone`, also for the light of the voxels.
    Pcf,
    /// The same with percentage-closer soft shadows.
    Pcss,
    /// Cones through the voxels (only `voxel-cone`): soft and without noise, but they miss what is smaller than a
    /// voxel.
    Cones,
}

impl RealtimeArguments {
    /// The flag, if any, that means nothing to the reference.
    pub fn not_of_reference(&self) -> Option<&'static str> {
        match () {
            () if self.shadows != ShadowArgument::Rays => Some("shadows"),
            () if self.debug_view.is_some() => Some("debug-view"),
            () if self.net.is_given() => Some("net"),
            () => (!self.bake.is_empty()).then_some("bake"),
        }
    }

    /// Whether something else than light is shown.
    pub fn shows_debug_view(&self) -> bool {
        self.debug_view.is_some()
    }

    /// Whether light of a file is used.
    pub fn has_bake(&self) -> bool {
        !self.bake.is_empty()
    }

    /// How shadow maps are filtered; None: no shadow maps.
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

/// A file of baked light, and how much of it.
#[derive(Clone, Debug)]
struct BakeChoice {
    file: std::path::PathBuf,
    weight: f32,
}

fn parse_bake(text: &str) -> Result<BakeChoice, String> {
    let whole = |weight| BakeChoice { file: text.into(), weight };
    let Some((file, weight)) = text.rsplit_once('=') else { return Ok(whole(1.0)) };
    match weight.parse::<f32>() {
        Ok(weight) if (0.0..=1e6).contains(&weight) => Ok(BakeChoice { file: file.into(), weight }),
        Ok(_) => Err("expected a weight between 0 and 1e6".into()),
        // A name with a sign.
        Err(_) => Ok(whole(1.0)),
    }
}

/// The technique with baked light. Says what has changed in the scene since.
fn from_bakes(
    gpu: &Gpu,
    gpu_scene: &GpuScene,
    (scene, diffuse_only): (&Scene, bool),
    settings: &[(&str, &str)],
    bakes: &[BakeChoice],
) -> Result<ProbeVolume, Box<dyn std::error::Error>> {
    let settings = ProbeVolumeSettings::from_texts(settings)?;
    let fingerprint = SceneFingerprint::of(scene, diffuse_only, &|_| false);
    let mut read = Vec::new();
    for choice in bakes {
        let bake = crate::bake::read(&choice.file)?;
        let file = choice.file.display();
        let changes = bake.check(&fingerprint).map_err(|error| format!("{file}: {error}"))?;
        // Several are of several lights.
        for change in changes.iter().filter(|of| bakes.len() == 1 || !of.starts_with("lights")) {
            errln!("warning: {file}: {change}");
        }
        read.push(bake);
    }
    let read: Vec<_> = read.iter().collect();
    let mut made = ProbeVolume::from_bakes(gpu, gpu_scene, settings, &read)?;
    let weights: Vec<_> = bakes.iter().map(|choice| choice.weight).collect();
    made.probes_mut().set_weights(&weights);
    Ok(made)
}

/// The technique with baked light, and that of the scene's sky by its parts.
fn with_sky(
    gpu: &Gpu,
    gpu_scene: &GpuScene,
    (scene, diffuse_only): (&Scene, bool),
    settings: &[(&str, &str)],
    choice: &BakeChoice,
) -> Result<ProbeVolume, Box<dyn std::error::Error>> {
    let settings = ProbeVolumeSettings::from_texts(settings)?;
    let mut dark = scene.clone();
    dark.sky = Sky::Constant(glam::Vec3::ZERO);
    let parts = (0..N_SKY_PARTS).map(|ix| crate::bake::sky_file(&choice.file, ix));
    let mut read = Vec::new();
    for (ix, file) in std::iter::once(choice.file.clone()).chain(parts).enumerate() {
        if ix > 0 && !file.exists() {
            let name = file.display();
            return Err(format!("{name} is missing: bake with --sky-parts for --bake-sky").into());
        }
        let bake = crate::bake::read(&file)?;
        let file = file.display();
        // (The parts have no light but the sky's.)
        let own =
            if ix == 0 { dark.clone() } else { crate::bake::part_scene(dark.clone(), ix - 1) };
        let fingerprint = SceneFingerprint::of(&own, diffuse_only, &|_| false);
        for change in bake.check(&fingerprint).map_err(|error| format!("{file}: {error}"))? {
            errln!("warning: {file}: {change}");
        }
        read.push(bake);
    }
    let read: Vec<_> = read.iter().collect();
    let mut made = ProbeVolume::from_bakes(gpu, gpu_scene, settings, &read)?;
    let (weights, lost) = sky_part_weights(&scene.sky);
    let own = glam::Vec3::splat(choice.weight);
    made.probes_mut().set_colours(&[&[own], weights.as_slice()].concat());
    if lost > 0.1 {
        errln!(
            "note: the sky has detail that its parts do not: {:.0} % of it (root mean square); reflected light is that of a smoother sky",
            100.0 * lost
        );
    }
    Ok(made)
}

/// The technique with those probes of a file that are nearest to a place, in so many bytes.
fn from_file(
    gpu: &Gpu,
    gpu_scene: &GpuScene,
    (scene, diffuse_only): (&Scene, bool),
    settings: &[(&str, &str)],
    choice: &BakeChoice,
    (place, most_bytes): (glam::Vec3, u64),
) -> Result<ProbeVolume, Box<dyn std::error::Error>> {
    let settings = ProbeVolumeSettings::from_texts(settings)?;
    let name = choice.file.display();
    if choice.weight != 1.0 {
        return Err("--bake-memory takes a bake as it is, without a weight".into());
    }
    let fail = |error: BakeError| format!("{name}: {error}");
    let mut file = ProbeFile::open(&choice.file).map_err(fail)?;
    let fingerprint = SceneFingerprint::of(scene, diffuse_only, &|_| false);
    for change in file.head().check(&fingerprint).map_err(fail)? {
        errln!("warning: {name}: {change}");
    }
    let mut made = ProbeVolume::from_file(gpu, gpu_scene, settings, &file, most_bytes)?;
    let found = made.probes_mut().stream(gpu, &mut file, place, u32::MAX).map_err(fail)?;
    if found.radius.is_finite() {
        errln!(
            "{} of {} probes are loaded: all that are within {:.2} m of the camera",
            made.probes().n_in_memory(),
            file.n_probes(),
            found.radius
        );
    }
    Ok(made)
}

/// Angular radius of the sun [degrees].
const SUN_RADIUS: f32 = 0.27;

fn parse_radius(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(radius) if (0.0..=1e6).contains(&radius) => Ok(radius),
        _ => Err("expected metres between 0 and 1e6".into()),
    }
}

fn parse_percent(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(percent) if (0.0..=100.0).contains(&percent) => Ok(percent),
        _ => Err("expected a number between 0 and 100".into()),
    }
}

fn parse_near(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(near) if (1e-12..=1e6).contains(&near) => Ok(near),
        _ => Err("expected metres between 1e-12 and 1e6".into()),
    }
}

/// What a technique has rendered.
pub struct Rendered {
    pub sums: Vec<PixelSums>,
    pub stats: FrameStats,
    /// Of the technique, read.
    pub of_technique: Vec<(Stat, u64)>,
}

/// The technique, with its bake, if it has one.
fn technique_of(
    arguments: &RenderArguments,
    technique: &TechniqueEntry,
    ready: &Ready,
    settings: &[(&str, &str)],
    of_voxels: &LightVisibility,
) -> Result<Box<dyn Technique>, Box<dyn std::error::Error>> {
    let Ready { camera, gpu, rays, gpu_scene, scene, .. } = ready;
    let rays = *rays;
    let net = &arguments.realtime.net;
    if net.is_given() && technique.name != BAKES {
        return Err(format!("--net means nothing to the technique {}", technique.name).into());
    }
    if net.is_given() && !arguments.realtime.bake.is_empty() {
        return Err("--net means nothing with --bake: probes are where the bake has them".into());
    }
    Ok(match arguments.realtime.bake.as_slice() {
        [] if net.is_given() => {
            let chosen = ProbeVolumeSettings::from_texts(settings)?;
            match net.make(gpu, gpu_scene, settings)? {
                Some(net) => Box::new(ProbeVolume::on_net(gpu, gpu_scene, chosen, net)?),
                None => technique.make(gpu, gpu_scene, settings, of_voxels, camera.position)?,
            }
        }
        bakes if technique.name == NEEDS_BAKE => {
            let baked = match bakes {
                [] => None,
                [bake] if bake.weight == 1.0 => Some(bake.file.as_path()),
                _ => return Err(format!("{NEEDS_BAKE} takes one --bake, without a weight").into()),
            };
            let of = (gpu, gpu_scene, scene, (arguments.scene.diffuse, rays));
            Box::new(crate::sparse_bake::technique(of, settings, baked, of_voxels)?)
        }
        [] => technique.make(gpu, gpu_scene, settings, of_voxels, camera.position)?,
        bakes if technique.name == BAKES => {
            if let Some((name, _)) = settings.iter().find(|(name, _)| {
                BAKED.contains(name)
                    && (*name != "seed")
                    && !(*name == "bounces" && arguments.bounces.is_none())
            }) {
                return Err(
                    format!("--{name} is the bake's: it cannot be chosen with --bake").into()
                );
            }
            let of_look_up: Vec<_> =
                settings.iter().copied().filter(|(name, _)| !BAKED.contains(name)).collect();
            let of = (scene, arguments.scene.diffuse);
            Box::new(match arguments.realtime.bake_memory {
                None if arguments.realtime.bake_sky => {
                    let [bake] = bakes else {
                        return Err("--bake-sky takes one --bake".into());
                    };
                    with_sky(gpu, gpu_scene, of, &of_look_up, bake)?
                }
                None => from_bakes(gpu, gpu_scene, of, &of_look_up, bakes)?,
                Some(megabytes) => {
                    let [bake] = bakes else {
                        return Err("--bake-memory takes one --bake: parts are not blended".into());
                    };
                    let around = (camera.position, u64::from(megabytes) * 1_000_000);
                    from_file(gpu, gpu_scene, of, &of_look_up, bake, around)?
                }
            })
        }
        _ => return Err(format!("--bake means nothing to the technique {}", technique.name).into()),
    })
}

/// Renders frames with the technique. `tells`: its notes, and how light has settled, are written.
pub fn frames_of(
    arguments: &RenderArguments,
    technique: &TechniqueEntry,
    ready: &Ready,
    interrupted: &AtomicBool,
    tells: bool,
) -> Result<Rendered, Box<dyn std::error::Error>> {
    let output = &arguments.output;
    let shadows = arguments.realtime.shadows;
    let mut settings = arguments.settings.of(technique)?;
    let has = |name: &str| technique.settings.iter().any(|setting| setting.name == name);
    let (bounces, seed) = (arguments.bounces.map(|n| n.to_string()), output.seed.to_string());
    settings.extend(bounces.as_deref().filter(|_| has("bounces")).map(|n| ("bounces", n)));
    settings.extend(has("seed").then_some(("seed", seed.as_str())));
    let Ready { camera, size, gpu, info, gpu_scene, .. } = ready;
    let maps = match arguments.realtime.filtering() {
        Some(filtering) => {
            let settings = ShadowSettings::new(arguments.realtime.shadow_size, filtering);
            Some(ShadowMaps::new(gpu, gpu_scene, settings)?)
        }
        None => None,
    };
    let of_voxels = maps.as_ref().map(ShadowMaps::visibility).unwrap_or_default();
    let mut made = technique_of(arguments, technique, ready, &settings, &of_voxels)?;
    for notice in made.notices().iter().filter(|_| tells) {
        errln!("{}{}", if notice.is_warning { "warning: " } else { "" }, notice.text);
    }
    let visibility = match shadows {
        ShadowArgument::Cones => made
            .visibility()
            .ok_or("--shadows cones needs --technique voxel-cone --tracing prefiltered")?,
        _ => of_voxels,
    };
    if let Some(name) = &arguments.realtime.debug_view
        && !made.debug_views().iter().any(|view| view.name == name)
    {
        let names: Vec<_> = made.debug_views().iter().map(|view| view.name).collect();
        let has = if names.is_empty() { "none".into() } else { names.join(", ") };
        return Err(format!("no debug view `{name}`: {} has {has}", made.name()).into());
    }
    if output.channel == ChannelArgument::Openness && !made.finds_openness() {
        let name = made.name();
        return Err(format!(
            "{name} does not find --channel openness; voxel-cone and reference do"
        )
        .into());
    }
    let what = settings!(FramesToRender {
        view: settings!(ViewSettings {
            n_accumulated: arguments.frames,
            seed: output.seed,
            near: arguments.realtime.near,
            irradiance: output.channel == ChannelArgument::Irradiance,
            occlusion_distance: output.occlusion_distance,
        }),
        direct: settings!(DirectSettings {
            n_samples: arguments.realtime.light_samples,
            // Cones find light by sampling lights only, not by sampling the BSDF.
            n_bsdf_samples: if shadows == ShadowArgument::Cones {
                0
            } else {
                DirectSettings::default().n_bsdf_samples
            },
        }),
        n_warm_up: arguments.realtime.warm_up,
        settled_below: 0.01 * arguments.realtime.settled,
        timed: output.timings.is_some(),
        ..FramesToRender::new(*size, arguments.frames)
    });
    if tells && info.device_type == wgpu::DeviceType::Cpu {
        errln!("compiling the kernels (takes some seconds; the driver caches them for next time)");
    }
    let mut meter = Meter::new("rendering");
    let mut passes = FramePasses::with_visibility(gpu, gpu_scene, *size, what.direct, &visibility)?;
    passes.shadow_maps = maps;
    passes.debug_view = arguments.realtime.debug_view.clone();
    let keep_going = |progress: Progress| {
        meter.show(progress.done, progress.total);
        !interrupted.load(Ordering::Relaxed)
    };
    let (passes, stats) =
        render_frames_with(gpu, gpu_scene, camera, &what, &mut *made, passes, keep_going)?;
    meter.finish();
    let sums = read_film(gpu, passes.accumulator.film())?;
    let left_out: u64 = sums.iter().map(|pixel| u64::from(pixel.n_rejected)).sum();
    if left_out + u64::from(stats.n_rejected) > 0 {
        errln!(
            "warning: light was not finite, or its cones took more steps than this driver allows in a loop: direct light was replaced by 0 {} times, and a pixel of a frame was left out {left_out} times",
            stats.n_rejected
        );
    }
    if stats.n_cut > 0 {
        errln!(
            "warning: direct light of {} pixels (over {} frames) is wrong: this driver ends loops after 65535 iterations; use fewer --light-samples",
            stats.n_cut,
            stats.n_frames
        );
    }
    let of_technique = warn_of_faults(gpu, made.stats())?;
    if stats.stopped {
        errln!("stopped: {} of {} frames", stats.n_frames, arguments.frames);
    }
    if tells {
        report_settling(&stats, arguments.realtime.settled);
    }
    Ok(Rendered { sums, stats, of_technique })
}

/// Renders frames with the technique, and writes the requested channel.
pub fn render(arguments: &RenderArguments, technique: &TechniqueEntry) -> CommandResult {
    let output = &arguments.output;
    let ready = prepare(
        (&arguments.scene, &arguments.objects, &arguments.view),
        &arguments.adapter,
        output,
    )?;
    let interrupted = interrupt_flag()?;
    let Rendered { sums, stats, of_technique } =
        frames_of(arguments, technique, &ready, &interrupted, true)?;
    let Ready { size, info, rays, .. } = ready;
    let channel = match arguments.realtime.debug_view {
        Some(_) => ChannelArgument::Indirect,
        None => output.channel,
    };
    write_picture(&sums, size, output, channel)?;
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
        write_timings(file, &info, rays, count, stats.wall_time, passes.collect(), &of_technique)?;
    }
    errln!("rendered in {:.2} s", stats.wall_time.as_secs_f64());
    outln!("{}", output.output.display())?;
    Ok(())
}

/// Says how much light was still on its way before the first accumulated frame.
fn report_settling(stats: &FrameStats, settled: f32) {
    let Some(percent) = stats.light_to_come.map(|share| 100.0 * share) else { return };
    let n = stats.n_warm_up;
    if percent < settled {
        errln!("light settled in {n} frames: at most {percent:.2} % of it was still on its way");
    } else if settled > 0.0 && !stats.stopped {
        errln!(
            "after {n} frames, up to {percent:.2} % of the light was still on its way, or is noise: --warm-up {} will tell",
            n.saturating_mul(2)
        );
    }
}
