// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna bake --technique sparse-probes`, `lucerna merge`, and `lucerna render` with such bakes.

use super::CommandResult;
use super::bake::{BakeArguments, part_of};
use super::net_args::read_points;
use super::progress::Meter;
use super::render::settings::{NEEDS_BAKE, baked_settings};
use super::render::{check_writable, interrupt_flag, upload};
use clap::Args;
use glam::Vec3;
use lucerna::blocking::{
    BakeStage, SparseBakeError, SparseScene, bake_sparse_probes, plan_sparse_probes,
};
use lucerna::components::LightVisibility;
use lucerna::components::sparse_probes::{SparseBake, SparseError, SparseSettings};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, RaySource, WorldTriangles};
use lucerna::scene::{Scene, SceneFingerprint};
use lucerna::seam::{NO_MESH, StaticMesh};
use lucerna::techniques::sparse_probes::{SparseProbesSettings, SparseProbesTechnique};
use lucerna::techniques::{Settings, TechniqueEntry};
use std::error::Error;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Part `0` of `1`, from 0 on.
#[derive(Clone, Copy, Debug)]
pub struct Shard([u32; 2]);

pub fn parse_shard(text: &str) -> Result<Shard, String> {
    let parsed = text.split_once('/').and_then(|(k, n)| Some([k.parse().ok()?, n.parse().ok()?]));
    match parsed {
        Some([k, n]) if k < n && n <= 1 << 16 => Ok(Shard([k, n])),
        _ => Err("expected K/N with 0 ≤ K < N ≤ 65536, such as 0/17".into()),
    }
}

/// `lucerna merge`.
#[derive(Args, Clone, Debug)]
pub struct MergeArguments {
    /// The parts, in any order.
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// The whole.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

pub fn merge(arguments: &MergeArguments) -> CommandResult {
    check_writable(&arguments.output)?;
    let mut parts = Vec::new();
    for file in &arguments.parts {
        parts.push((file.display().to_string(), read(file)?));
    }
    let whole = SparseBake::merge(parts).map_err(|error| match error {
        SparseError::OtherPart(_) => error.to_string().replacen("it is", "this file is", 1),
        other => format!("the parts are not a whole bake: {other}"),
    })?;
    whole.write(&arguments.output)?;
    outln!("{}", arguments.output.display())?;
    Ok(())
}

/// Reads a whole file; the message names it.
fn read(file: &Path) -> Result<SparseBake, String> {
    SparseBake::read(file, true).map_err(|error| format!("{}: {error}", file.display()))
}

/// A scene, as bakes need it.
struct Baked<'a> {
    gpu: &'a Gpu,
    gpu_scene: &'a GpuScene,
    meshes: Vec<StaticMesh>,
    fingerprint: SceneFingerprint,
}

impl<'a> Baked<'a> {
    fn new((gpu, gpu_scene, scene, diffuse): (&'a Gpu, &'a GpuScene, &Scene, bool)) -> Self {
        let meshes = WorldTriangles::of(scene).static_meshes(scene);
        Self {
            gpu,
            gpu_scene,
            meshes,
            fingerprint: SceneFingerprint::of(scene, diffuse, &|_| false),
        }
    }

    fn scene(&self) -> SparseScene<'_> {
        SparseScene {
            seam: self.gpu_scene,
            meshes: &self.meshes,
            order: self.gpu_scene.triangle_order(),
            fingerprint: self.fingerprint,
        }
    }
}

/// Shows how far a bake is, and asks whether it is to go on.
struct Watch<'a> {
    stage: Mutex<(Option<&'static str>, Meter)>,
    interrupted: &'a AtomicBool,
}

impl Watch<'_> {
    fn goes_on(&self, stage: BakeStage) -> bool {
        let (name, done) = match stage {
            BakeStage::Looking(done, all) => ("which probes see what", Some((done, all))),
            BakeStage::Transport(done, all) => ("transport", Some((done, all))),
            BakeStage::Unwrapping => ("texture coordinates", None),
            _ => ("placing probes", None),
        };
        if let Ok(mut known) = self.stage.lock() {
            if known.0 != Some(name) {
                known.1.finish();
                *known = (Some(name), Meter::new(name));
                errln!("{name}");
            }
            if let Some((done, all)) = done {
                known.1.show(done.into(), all.into());
            }
        }
        !self.interrupted.load(Ordering::Relaxed)
    }

    fn finish(&self) {
        if let Ok(known) = self.stage.lock() {
            known.1.finish();
        }
    }
}

pub fn bake(arguments: &BakeArguments, technique: &TechniqueEntry) -> CommandResult {
    let output = &arguments.output;
    let seed = arguments.seed.to_string();
    let mut texts = arguments.settings.of(technique)?;
    texts.push(("seed", &seed));
    let settings = SparseProbesSettings::from_texts(&texts)?.bake;
    let shard = arguments.shard.map_or([0, 1], |shard| shard.0);
    let points = arguments.probe_list.as_deref().map(read_points).transpose()?;
    let scene = arguments.scene.load()?;
    let (gpu, _, rays) = arguments.adapter.open()?;
    let interrupted = interrupt_flag()?;
    let gpu_scene = upload(&gpu, &scene, arguments.scene.diffuse, rays)?;
    let baked = Baked::new((&gpu, &gpu_scene, &scene, arguments.scene.diffuse));
    let started = Instant::now();
    let watch = Watch { stage: Mutex::new((None, Meter::new(""))), interrupted: &interrupted };
    let part = part_of(output);
    let begun = if arguments.fresh {
        None
    } else {
        begun(&part, &baked.fingerprint, (&settings, shard), points.as_deref())
    };
    let mut bake = match begun {
        Some(bake) => bake,
        None => {
            let plan = plan(&baked, settings, points.as_deref(), &watch)?;
            SparseBake::begun(plan, shard)
        }
    };
    report_plan(&bake);
    // What is done is kept as it is done.
    bake.write(&part).map_err(|error| format!("cannot write {}: {error}", part.display()))?;
    let mut file = OpenOptions::new().append(true).open(&part)?;
    let result = fill(&baked, &mut bake, &watch, Some(&mut file));
    watch.finish();
    match result {
        Err(SparseBakeError::Stopped) => {
            return Err(format!(
                "stopped; {} has {} of {} clusters, and the same command goes on",
                part.display(),
                bake.clusters.len(),
                bake.clusters.len() + bake.missing().len()
            )
            .into());
        }
        other => other.map_err(|error| format!("{}: {error}", part.display()))?,
    }
    bake.write(output).map_err(|error| format!("cannot write {}: {error}", output.display()))?;
    if let Err(error) = std::fs::remove_file(&part) {
        errln!("warning: {} could not be removed: {error}", part.display());
    }
    report_quality(&bake);
    errln!(
        "{} bytes, {:.2} s",
        std::fs::metadata(output).map_or(0, |of| of.len()),
        started.elapsed().as_secs_f64()
    );
    outln!("{}", output.display())?;
    Ok(())
}

/// An unfinished bake of the same scene and settings.
fn begun(
    part: &Path,
    scene: &SceneFingerprint,
    (settings, shard): (&SparseSettings, [u32; 2]),
    points: Option<&[Vec3]>,
) -> Option<SparseBake> {
    match SparseBake::read(part, false) {
        Ok(bake) if bake.goes_on_as(scene, settings, shard, points) => {
            errln!("{} has {} clusters, and goes on", part.display(), bake.clusters.len());
            Some(bake)
        }
        Ok(_) => {
            errln!("note: {} is of another bake, and is not used", part.display());
            None
        }
        Err(SparseError::Io(error)) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => {
            errln!("note: {} is not used: {error}", part.display());
            None
        }
    }
}

fn plan(
    baked: &Baked,
    settings: SparseSettings,
    points: Option<&[Vec3]>,
    watch: &Watch,
) -> Result<lucerna::components::sparse_probes::SparsePlan, Box<dyn Error>> {
    let mut notes = Vec::new();
    let going = |stage| watch.goes_on(stage);
    let plan = plan_sparse_probes(baked.gpu, &baked.scene(), settings, points, &mut notes, &going);
    watch.finish();
    notes.iter().for_each(|note| errln!("note: {note}"));
    plan.map_err(|error| match error {
        SparseBakeError::Stopped => "stopped before anything could be kept".into(),
        other => Box::<dyn Error>::from(other),
    })
}

fn report_plan(bake: &SparseBake) {
    let plan = &bake.plan;
    errln!(
        "{} probes (radius {:.3} m), {} receivers in {} clusters, lightmap of {} x {} texels of {:.3} m",
        plan.probes.len(),
        plan.radius,
        plan.receivers.len(),
        plan.n_clusters(),
        plan.size.x,
        plan.size.y,
        1.0 / plan.texels_per_metre
    );
    let [n, unseen] = plan.coverage;
    let percent = 100.0 * f64::from(unseen) / f64::from(n.max(1));
    errln!("{percent:.2} % of what surfaces see is seen by no probe within the radius");
    let n_unknown = plan.n_unknown();
    if n_unknown > 0 {
        errln!(
            "{:.2} % of what probes see has no texel, and is black to them",
            100.0 * n_unknown as f64 / plan.seen.len().max(1) as f64
        );
    }
}

fn report_quality(bake: &SparseBake) {
    let mut kept: Vec<f32> = bake.seen_clusters().map(|of| of.energy).collect();
    kept.sort_by(f32::total_cmp);
    if let [worst, ..] = kept[..] {
        errln!(
            "energy kept: {:.3} % in the median cluster, {:.3} % in the worst",
            100.0 * kept[kept.len() / 2],
            100.0 * worst
        );
    }
}

/// Computes what is missing, and appends it to the file.
fn fill(
    baked: &Baked,
    bake: &mut SparseBake,
    watch: &Watch,
    mut file: Option<&mut File>,
) -> Result<(), SparseBakeError> {
    bake_sparse_probes(
        baked.gpu,
        &baked.scene(),
        bake,
        |cluster, _| match &mut file {
            Some(file) => {
                let bytes: Vec<u8> =
                    cluster.words().iter().flat_map(|word| word.to_le_bytes()).collect();
                file.write_all(&bytes)
            }
            None => Ok(()),
        },
        |stage| watch.goes_on(stage),
    )
}

/// The technique, with the light of a bake; without one, bakes in memory. The `GpuScene` may have things that move besides the scene.
pub fn technique(
    (gpu, gpu_scene, scene, (diffuse, rays)): (&Gpu, &GpuScene, &Scene, (bool, RaySource)),
    settings: &[(&str, &str)],
    file: Option<&Path>,
    visibility: &LightVisibility,
) -> Result<SparseProbesTechnique, Box<dyn Error>> {
    let chosen = SparseProbesSettings::from_texts(settings)?;
    let bake = match file {
        Some(file) => {
            let is_baked = |name: &str| baked_settings(NEEDS_BAKE).contains(&name);
            if let Some((name, _)) = settings.iter().find(|(name, _)| is_baked(name)) {
                return Err(
                    format!("--{name} is the bake's: it cannot be chosen with --bake").into()
                );
            }
            let fail = |error: SparseError| format!("{}: {error}", file.display());
            let bake = SparseBake::read(file, true).map_err(fail)?;
            bake.check(&SceneFingerprint::of(scene, diffuse, &|_| false)).map_err(fail)?;
            bake.check_complete().map_err(fail)?;
            bake
        }
        None => {
            errln!(
                "baking for this picture alone: `lucerna bake --technique {NEEDS_BAKE}` keeps it"
            );
            // (What moves is no part of the bake.)
            let still = match gpu_scene.static_order().contains(&NO_MESH) {
                true => Some(upload(gpu, scene, diffuse, rays)?),
                false => None,
            };
            let still = still.as_ref().unwrap_or(gpu_scene);
            let interrupted = AtomicBool::new(false);
            let watch =
                Watch { stage: Mutex::new((None, Meter::new(""))), interrupted: &interrupted };
            let baked = Baked::new((gpu, still, scene, diffuse));
            let mut bake = SparseBake::begun(plan(&baked, chosen.bake, None, &watch)?, [0, 1]);
            report_plan(&bake);
            let result = fill(&baked, &mut bake, &watch, None);
            watch.finish();
            result?;
            bake
        }
    };
    let order = gpu_scene.static_order();
    Ok(SparseProbesTechnique::new(gpu, gpu_scene, &bake, order, chosen, visibility)?)
}
