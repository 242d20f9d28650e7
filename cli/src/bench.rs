// SPDX-License-Identifier: MIT OR Apache-2.0
//! `lucerna bench`.

mod frames;
mod leaks;
mod probe_volume;
mod rays;
mod reference;
mod room;
mod sparse_probes;
mod voxel_cone;
mod voxel_rt;
mod voxel_write;
mod voxelize;

use super::CommandResult;
use super::scene_args::{AdapterArguments, CameraChoice};
use clap::Args;
use lucerna::blocking::{read_timers, wait};
use lucerna::gpu::{Gpu, PassTimers, Recorder};
use serde_json::Value;
use std::error::Error;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// `lucerna bench`.
#[derive(Args, Clone, Debug)]
pub struct BenchArguments {
    /// What to measure. Without it: rays, reference and voxelize, which take less time than the others.
    #[arg(value_enum)]
    group: Option<Group>,
    /// Measure on this scene instead of the generated room of 270 348 triangles.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    /// The camera in --scene's file, or "eye=x,y,z target=x,y,z fov=DEG".
    #[arg(long, value_name = "NAME|SPEC", requires = "scene")]
    camera: Option<CameraChoice>,
    /// Measure voxel-rt, voxel-cone, probe-volume, sparse-probes and voxel-write at small sizes only, and leaks in few houses.
    #[arg(long)]
    quick: bool,
    /// With `leaks`: measure only this technique.
    #[arg(long, value_name = "NAME")]
    technique: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    adapter: AdapterArguments,
}

#[derive(clap::ValueEnum, Clone, Copy, Debug, PartialEq)]
enum Group {
    /// BVH traversal, compared with obvhs's own on one CPU thread.
    Rays,
    /// Samples per second of the path tracer.
    Reference,
    /// Voxelization by compute and by the rasteriser, and the share of voxels that the rasteriser misses.
    Voxelize,
    /// Passes of `voxel-rt`, next to its source's configuration (takes minutes; runs only when named).
    VoxelRt,
    /// Passes of `voxel-cone`, next to its source's table, and what a step of a cone costs (takes minutes; runs only
    /// when named).
    VoxelCone,
    /// Look-ups of `probe-volume` with each basis and kind of visibility, the error of each basis, and what baking costs (takes minutes;
    /// runs only when named).
    ProbeVolume,
    /// Passes of `sparse-probes` over order, probes and receivers, and how fast its products read their matrices (takes minutes; runs only
    /// when named).
    SparseProbes,
    /// Light that leaks through walls at any angle, for each technique that stores light in cells, in houses drawn at random (takes
    /// an hour on a CPU, with --quick minutes; runs only when named).
    Leaks,
    /// Ways to write irradiance into voxels: store, moving average, max, exact (takes minutes; runs only when named).
    VoxelWrite,
}

/// GPU time of what `record` records, in one submission; wall time if the device has no timestamps.
fn timed(
    gpu: &Gpu,
    record: impl FnOnce(&mut Recorder) -> Result<(), Box<dyn Error>>,
) -> Result<Duration, Box<dyn Error>> {
    let mut timers = PassTimers::new(gpu);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut Recorder::timed(gpu, &mut encoder, timers.as_mut()))?;
    if let Some(timers) = &timers {
        timers.resolve(&mut encoder);
    }
    let begun = Instant::now();
    gpu.queue.submit([encoder.finish()]);
    Ok(match &timers {
        Some(timers) => read_timers(gpu, timers)?.into_iter().map(|(_, time)| time).sum(),
        None => {
            wait(gpu)?;
            begun.elapsed()
        }
    })
}

/// One line of a table.
struct Row {
    name: String,
    value: f64,
    unit: &'static str,
    /// The value divided by the baseline's, and the baseline's name.
    ratio: Option<(f64, &'static str)>,
}

impl Row {
    fn new(name: impl Into<String>, value: f64, unit: &'static str) -> Self {
        Self { name: name.into(), value, unit, ratio: None }
    }
}

pub fn bench(arguments: &BenchArguments) -> CommandResult {
    if cfg!(debug_assertions) {
        errln!("note: this is a debug build; the CPU side is slower than in a release build");
    }
    let wants = |group| arguments.group.is_none_or(|wanted| wanted == group);
    let (gpu, info, source) = arguments.adapter.open()?;
    let (scene, camera) = match &arguments.scene {
        Some(file) => super::scene_args::load_with_camera(file, arguments.camera.as_ref())?,
        None => room::room(),
    };
    let mut groups = Vec::new();
    if wants(Group::Rays) {
        groups.push(("rays", rays::measure(&gpu, &scene, &camera, source)?));
    }
    if wants(Group::Reference) {
        groups.push(("reference", reference::measure(&gpu, &scene, &camera, source)?));
    }
    if wants(Group::Voxelize) {
        groups.push(("voxelize", voxelize::measure(&gpu, &scene, source)?));
    }
    if arguments.group == Some(Group::VoxelRt) {
        let rows = voxel_rt::measure(&gpu, &scene, &camera, source, arguments.quick)?;
        groups.push(("voxel-rt", rows));
    }
    if arguments.group == Some(Group::VoxelCone) {
        let rows = voxel_cone::measure(&gpu, &scene, &camera, source, arguments.quick)?;
        groups.push(("voxel-cone", rows));
    }
    if arguments.group == Some(Group::ProbeVolume) {
        let rows = probe_volume::measure(&gpu, &scene, &camera, source, arguments.quick)?;
        groups.push(("probe-volume", rows));
    }
    if arguments.group == Some(Group::SparseProbes) {
        let rows = sparse_probes::measure(&gpu, &scene, &camera, source, arguments.quick)?;
        groups.push(("sparse-probes", rows));
    }
    if arguments.group == Some(Group::Leaks) {
        groups.push((
            "leaks",
            leaks::measure(&gpu, source, arguments.quick, arguments.technique.as_deref())?,
        ));
    }
    if arguments.group == Some(Group::VoxelWrite) {
        let rows = voxel_write::measure(&gpu, &scene, source, arguments.quick)?;
        groups.push(("voxel-write", rows));
    }
    if arguments.json {
        let json = serde_json::json!({
            "adapter": info.name,
            "driver": info.driver_info,
            "groups": groups.iter().map(|(name, rows)| ((*name).to_owned(), rows_json(rows))).collect::<serde_json::Map<_, _>>(),
        });
        outln!("{}", serde_json::to_string_pretty(&json)?)?;
        return Ok(());
    }
    for (name, rows) in &groups {
        outln!("{name}")?;
        for row in rows {
            let ratio = match row.ratio {
                Some((ratio, baseline)) => format!("{ratio:>8.2} x {baseline}"),
                None => String::new(),
            };
            outln!("  {:<44} {:>10.3} {:<16} {ratio}", row.name, row.value, row.unit)?;
        }
    }
    Ok(())
}

fn rows_json(rows: &[Row]) -> Value {
    rows.iter()
        .map(|row| {
            serde_json::json!({
                "name": row.name,
                "value": row.value,
                "unit": row.unit,
                "ratio": row.ratio.map(|(ratio, _)| ratio),
                "baseline": row.ratio.map(|(_, baseline)| baseline),
            })
        })
        .collect()
}
