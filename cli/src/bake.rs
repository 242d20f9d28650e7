// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna bake`.

use super::CommandResult;
use super::net_args::NetArguments;
use super::progress::Meter;
use super::render::settings::{BAKES, NEEDS_BAKE, SettingArguments};
use super::render::{check_writable, interrupt_flag, upload, warn_of_faults};
use super::scene_args::{AdapterArguments, SceneArguments};
use clap::Args;
use clap::builder::PossibleValuesParser;
use glam::Vec3;
use lucerna::blocking::{read_probes, read_stat, wait};
use lucerna::components::probes::{BakeError, BakedLayout, ProbeBake, ProbeSettings, Probes};
use lucerna::gpu::{Gpu, Recorder};
use lucerna::gpu_scene::GpuScene;
use lucerna::gpu_scene::RaySource;
use lucerna::picture::write_whole_file;
use lucerna::scene::{N_SKY_PARTS, Scene, SceneFingerprint, Sky, sky_part};
use lucerna::techniques::probe_volume::ProbeVolumeSettings;
use lucerna::techniques::{Settings, TECHNIQUES};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// `lucerna bake`.
#[derive(Args, Clone, Debug)]
pub struct BakeArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Whose light is baked.
    #[arg(long, value_name = "TECHNIQUE", default_value = BAKES, value_parser = PossibleValuesParser::new([BAKES, NEEDS_BAKE]))]
    technique: String,
    /// The file. While it is being computed, FILE.part keeps what is there: after an interruption, the same command goes on.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Write positions and coefficients as JSON as well, for other programs.
    #[arg(long, value_name = "FILE.json")]
    json: Option<PathBuf>,
    /// Keep the places and distances of FILE, and gather its light anew.
    #[arg(long)]
    relight: bool,
    /// Bake the light of the sky apart, so that it can change afterwards: FILE is without the sky, and FILE.sky0 to FILE.sky8 are each of a part of it
    /// (for `render --bake-sky`). Takes ten times as long.
    #[arg(long, conflicts_with = "json")]
    sky_parts: bool,
    /// Begin anew, even if FILE or FILE.part could go on.
    #[arg(long, conflicts_with = "relight")]
    pub fresh: bool,
    /// Reflections before the one that is seen. [default: 15]
    #[arg(long, value_parser = clap::value_parser!(u32).range(0..=63))]
    bounces: Option<u32>,
    /// Seed of the random numbers.
    #[arg(long, default_value_t = 0)]
    pub seed: u32,
    /// Put the probes at the points of a JSON file, [[x, y, z], …] (only sparse-probes).
    #[arg(long, value_name = "FILE.json")]
    pub probe_list: Option<PathBuf>,
    /// Bake part K of N, to be joined with `lucerna merge` (only sparse-probes).
    #[arg(long, value_name = "K/N", value_parser = crate::sparse_bake::parse_shard)]
    pub shard: Option<crate::sparse_bake::Shard>,
    #[command(flatten)]
    pub settings: SettingArguments<true>,
    #[command(flatten)]
    net: NetArguments,
    #[command(flatten)]
    pub adapter: AdapterArguments,
}

/// Time between two writes of the unfinished file.
const SAVE_INTERVAL: Duration = Duration::from_secs(5);

pub fn bake(arguments: &BakeArguments) -> CommandResult {
    let Some(technique) = TECHNIQUES.iter().find(|of| of.name == arguments.technique) else {
        return Err(format!("{} bakes nothing", arguments.technique).into());
    };
    let output = &arguments.output;
    check_writable(output)?;
    if let Some(json) = &arguments.json {
        check_writable(json)?;
    }
    if technique.name == NEEDS_BAKE {
        let given = [
            (arguments.json.is_some(), "json"),
            (arguments.relight, "relight"),
            (arguments.sky_parts, "sky-parts"),
            (arguments.bounces.is_some(), "bounces"),
            (arguments.net.is_given(), "net"),
        ];
        if let Some((_, name)) = given.iter().find(|(is_given, _)| *is_given) {
            return Err(format!("--{name} means nothing to {NEEDS_BAKE}").into());
        }
        return crate::sparse_bake::bake(arguments, technique);
    }
    if arguments.probe_list.is_some() || arguments.shard.is_some() {
        return Err(format!("--probe-list and --shard mean nothing to {}", technique.name).into());
    }
    let bounces = arguments.bounces.map(|n| (n + 1).to_string());
    let seed = arguments.seed.to_string();
    let mut texts = arguments.settings.of(technique)?;
    texts.extend(bounces.as_deref().map(|n| ("bounces", n)));
    texts.push(("seed", &seed));
    let settings = ProbeVolumeSettings::from_texts(&texts)?.0;

    let scene = arguments.scene.load()?;
    let (gpu, info, rays) = arguments.adapter.open()?;
    let interrupted = interrupt_flag()?;
    let opened = (&gpu, &info, rays, &*interrupted);
    if !arguments.sky_parts {
        return bake_file(arguments, (settings, &texts), opened, &scene, (output, None));
    }
    let dark = Scene { sky: Sky::Constant(Vec3::ZERO), ..scene };
    bake_file(arguments, (settings, &texts), opened, &dark, (output, None))?;
    for ix in 0..N_SKY_PARTS {
        errln!("part {ix} of the sky");
        let part = part_scene(dark.clone(), ix);
        let file = sky_file(output, ix);
        bake_file(arguments, (settings, &texts), opened, &part, (&file, Some(output)))?;
    }
    Ok(())
}

/// A scene whose only light is a part of a sky.
pub fn part_scene(mut scene: Scene, ix: usize) -> Scene {
    scene.lights.clear();
    scene.materials.iter_mut().for_each(|material| material.emission = Vec3::ZERO);
    scene.sky = sky_part(ix);
    scene
}

/// The file of a part of the sky beside a bake.
pub fn sky_file(bake: &Path, ix: usize) -> PathBuf {
    let mut name = bake.as_os_str().to_owned();
    name.push(format!(".sky{ix}"));
    name.into()
}

/// Bakes one file; `places`: at the places of another.
fn bake_file(
    arguments: &BakeArguments,
    (settings, texts): (ProbeSettings, &[(&str, &str)]),
    (gpu, info, rays, interrupted): (&Gpu, &wgpu::AdapterInfo, RaySource, &AtomicBool),
    scene: &Scene,
    (output, places): (&Path, Option<&Path>),
) -> CommandResult {
    let gpu_scene = upload(gpu, scene, arguments.scene.diffuse, rays)?;
    let fingerprint = SceneFingerprint::of(scene, arguments.scene.diffuse, &|_| false);
    let net = arguments.net.make(gpu, &gpu_scene, texts)?;
    let points = net.as_ref().map(|net| net.points());
    let part = part_of(output);
    let start = match arguments.relight {
        true => Start::Places(Box::new(to_relight(output, &fingerprint, &settings, points)?)),
        false if arguments.fresh => Start::Nothing,
        false => to_go_on(&[&part, output], &fingerprint, &settings, points),
    };
    let start = match (start, places) {
        (Start::Nothing, Some(other)) => Start::Places(Box::new(read(other)?)),
        (start, _) => start,
    };
    let mut probes = match &start {
        Start::Nothing => match net {
            Some(net) => Probes::on_net(gpu, &gpu_scene, settings, net)?,
            None => Probes::new(gpu, &gpu_scene, settings)?,
        },
        Start::Places(bake) => Probes::placed_as(gpu, &gpu_scene, settings, bake, false)?,
        Start::Light(bake) => Probes::placed_as(gpu, &gpu_scene, settings, bake, true)?,
    };
    for notice in probes.notices() {
        errln!("{}", notice.text);
    }
    if info.device_type == wgpu::DeviceType::Cpu {
        errln!("compiling the kernels (takes some seconds; the driver caches them for next time)");
    }

    let mut meter = Meter::new("baking");
    let started = Instant::now();
    let n_before = match &start {
        Start::Light(bake) => n_paths_of(bake),
        _ => 0,
    };
    let mut saved = Instant::now();
    let mut n_active = 1;
    while probes.n_paths() < settings.n_paths && n_active > 0 {
        if interrupted.load(Ordering::Relaxed) {
            meter.finish();
            if probes.n_paths() == 0 {
                return Err(
                    "stopped before there were places for the probes; nothing is kept".into()
                );
            }
            read_probes(gpu, &probes, fingerprint)?.write(&part)?;
            return Err(format!(
                "stopped after {} of {} paths a probe; {} keeps them, and the same command goes on",
                probes.n_paths(),
                settings.n_paths,
                part.display()
            )
            .into());
        }
        n_active = update(gpu, &gpu_scene, &mut probes)?;
        meter.show(probes.n_paths().into(), settings.n_paths.into());
        if saved.elapsed() >= SAVE_INTERVAL && probes.n_paths() > 0 {
            read_probes(gpu, &probes, fingerprint)?.write(&part)?;
            saved = Instant::now();
        }
    }
    meter.finish();
    let stats = probes.stats().into_iter().filter(|stat| stat.name != "still to follow");
    warn_of_faults(gpu, stats)?;
    let bake = read_probes(gpu, &probes, fingerprint)?;
    bake.write(output).map_err(|error| format!("cannot write {}: {error}", output.display()))?;
    if let Some(json) = &arguments.json {
        write_whole_file(json, |to| -> std::io::Result<()> { writeln!(to, "{}", bake.to_json()) })
            .map_err(|error| format!("cannot write {}: {error}", json.display()))?;
    }
    match std::fs::remove_file(&part) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            errln!("warning: {} could not be removed: {error}", part.display());
        }
        _ => {}
    }
    let n_paths = n_paths_of(&bake) - n_before;
    errln!(
        "{} probes, {} paths each ({n_paths} new ones in all), {} bytes, {:.2} s",
        bake.probes.len(),
        if settings.noise > 0.0 { "at most ".to_owned() } else { String::new() }
            + &bake.n_paths.to_string(),
        std::fs::metadata(output).map_or(0, |of| of.len()),
        started.elapsed().as_secs_f64()
    );
    outln!("{}", output.display())?;
    Ok(())
}

/// Follows the next paths; returns how many probes did.
fn update(
    gpu: &Gpu,
    scene: &GpuScene,
    probes: &mut Probes,
) -> Result<u64, Box<dyn std::error::Error>> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    probes.update(&mut Recorder::new(gpu, &mut encoder), scene)?;
    gpu.queue.submit([encoder.finish()]);
    wait(gpu)?;
    let stats = probes.stats();
    let active = stats.iter().find(|stat| stat.name.starts_with("still changing"));
    Ok(active.map_or(Ok(1), |stat| read_stat(gpu, stat))?)
}

/// Paths of all probes together: each knows its own, because some stop before others.
fn n_paths_of(bake: &ProbeBake) -> u64 {
    bake.probes.iter().map(|probe| probe.gathered[0][3] as u64).sum()
}

/// What a bake begins with.
enum Start {
    Nothing,
    Places(Box<ProbeBake>),
    Light(Box<ProbeBake>),
}

/// Where an unfinished file is kept.
pub fn part_of(output: &Path) -> PathBuf {
    let mut name = output.as_os_str().to_owned();
    name.push(".part");
    name.into()
}

/// The first of these files that was begun with the same scene and settings, and has no more paths than are asked for.
fn to_go_on(
    files: &[&Path],
    scene: &SceneFingerprint,
    settings: &ProbeSettings,
    net: Option<&[Vec3]>,
) -> Start {
    for file in files {
        match ProbeBake::read(file) {
            Ok(bake) if bake.scene == *scene && bake.is_lit_like(settings, net) => {
                if bake.n_paths <= settings.n_paths {
                    errln!("{} has {} paths a probe, and goes on", file.display(), bake.n_paths);
                    return Start::Light(Box::new(bake));
                }
            }
            Ok(_) => errln!(
                "note: {} is of another scene or of other settings, and is not used",
                file.display()
            ),
            Err(BakeError::Io(error)) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => errln!("note: {} is not used: {error}", file.display()),
        }
    }
    Start::Nothing
}

fn to_relight(
    file: &Path,
    scene: &SceneFingerprint,
    settings: &ProbeSettings,
    net: Option<&[Vec3]>,
) -> Result<ProbeBake, Box<dyn std::error::Error>> {
    let bake = read(file)?;
    if bake.scene.shape != scene.shape || bake.scene.pose != scene.pose {
        return Err(format!(
            "{} cannot be relit: it is of another scene, or things have moved since; bake without --relight",
            file.display()
        )
        .into());
    }
    if net.is_some() || matches!(bake.layout, BakedLayout::Net { .. }) {
        // Points are kept, and a rule would find others if anything had moved.
        if !bake.is_placed_like(settings, net) {
            return Err(format!(
                "{} cannot be relit: its probes are not at the points of this --net; give the same, or bake without --relight",
                file.display()
            )
            .into());
        }
    } else if !bake.is_placed_like(settings, net) {
        return Err(format!(
            "{} cannot be relit: it has {} cells, relocation {} and refine {}; give the same, or bake without --relight",
            file.display(),
            bake.settings.cells,
            if bake.settings.moves { "on" } else { "off" },
            bake.settings.refine
        )
        .into());
    }
    Ok(bake)
}

/// Reads a bake; the message names the file.
pub fn read(file: &Path) -> Result<ProbeBake, String> {
    ProbeBake::read(file).map_err(|error| format!("{}: {error}", file.display()))
}
