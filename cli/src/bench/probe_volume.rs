// SPDX-License-Identifier: MIT OR Apache-2.0
//! `probe-volume`: what a look-up costs with each basis and each kind of visibility, how much each basis errs, and what baking costs.

use super::Row;
use super::frames::{Bench, sum_of, with_light};
use glam::{UVec2, Vec3};
use lucerna::blocking::{place_net, read_film, read_stat};
use lucerna::components::probe_net::NetSettings;
use lucerna::components::probes::{PATHS_PER_UPDATE, ProbeBasis, ProbeSettings, ProbeVisibility};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::probe_volume::{ProbeVolume, ProbeVolumeSettings};
use lucerna::techniques::reference::{Channel, resolve};
use std::error::Error;

/// The picture size of the source.
const PICTURE: UVec2 = UVec2::new(1435, 967);
/// More paths than the bench has time for: probes gather in all frames.
const ENDLESS: u32 = 1 << 20;
/// The passes that place probes.
const MOVED: [&str; 3] = ["probes/place", "voxels/voxelize", "probes/mark"];
const DEFAULT: &str = "sh2, distances";
const FRAME: &str = "G-buffer and direct light";

/// `quick`: pictures of a quarter of the side, half the cells along each axis.
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
    let (picture, cells) = if quick { (PICTURE / 4, 16) } else { (PICTURE, 32) };
    let ours = settings!(ProbeSettings { cells, n_paths: ENDLESS });
    let of_basis = |basis| settings!(ProbeSettings { basis, ..ours });
    let none = settings!(ProbeSettings { visibility: ProbeVisibility::None, ..ours });
    let mut configurations = vec![
        (DEFAULT, ours),
        ("sh2, no visibility", none),
        ("sh2, no visibility, no wrap", settings!(ProbeSettings { wraps: false, ..none })),
        ("sh2, masks", settings!(ProbeSettings { visibility: ProbeVisibility::Masks, ..ours })),
        ("sh2-float, distances", of_basis(ProbeBasis::Sh2Float)),
        ("sh2-bytes, distances", of_basis(ProbeBasis::Sh2Bytes)),
        ("sh1, distances", of_basis(ProbeBasis::Sh1)),
        ("ambient-cube, distances", of_basis(ProbeBasis::AmbientCube)),
        ("chroma-sh1, distances", of_basis(ProbeBasis::ChromaSh1)),
        ("chroma-constant, distances", of_basis(ProbeBasis::ChromaConstant)),
        ("sh4, distances", of_basis(ProbeBasis::Sh4)),
    ];
    let n_bases = configurations.len();
    for (name, factor) in [("half the cells", 2), ("a quarter of the cells", 4)] {
        configurations.push((name, settings!(ProbeSettings { cells: cells / factor, ..ours })));
    }
    let mut rigs = Vec::new();
    for (_, settings) in &configurations {
        rigs.push(
            bench
                .rig(picture, ProbeVolume::new(gpu, &gpu_scene, ProbeVolumeSettings(*settings))?)?,
        );
    }
    let net = place_net(gpu, &gpu_scene, &NetSettings::default())?.net;
    let nets = [("a net, distances", ours), ("a net, no visibility", none)];
    for (_, settings) in &nets {
        let settings = ProbeVolumeSettings(*settings);
        let technique = ProbeVolume::on_net(gpu, &gpu_scene, settings, net.clone())?;
        rigs.push(bench.rig(picture, technique)?);
    }
    let all = bench.run(&mut rigs, &MOVED)?;
    let pictures = rigs
        .iter()
        .map(|rig| {
            let sums = read_film(gpu, rig.passes.accumulator.film())?;
            Ok(resolve(&sums, picture, Channel::Indirect).rgb)
        })
        .collect::<Result<Vec<_>, lucerna::blocking::LostGpu>>()?;
    let mut rows = Vec::new();
    let shade = |ix: usize| sum_of(&all[ix], &["probe_volume/shade"]);
    let frame = sum_of(&all[0], &["frame/gbuffer", "frame/direct"]);
    rows.push(Row::new(FRAME, frame, "ms"));
    let exact = 4;
    for (ix, (name, _)) in configurations.iter().take(n_bases).enumerate() {
        let ratio = Some((shade(ix) / frame, FRAME));
        rows.push(Row { ratio, ..Row::new(format!("look-up, {name}"), shade(ix), "ms") });
    }
    rows.push(Row::new("probes of a net", net.points().len() as f64, ""));
    for (ix, (name, _)) in nets.iter().enumerate() {
        let time = shade(configurations.len() + ix);
        let ratio = Some((time / frame, FRAME));
        rows.push(Row { ratio, ..Row::new(format!("look-up, sh2, {name}"), time, "ms") });
    }
    for (ix, (name, settings)) in configurations.iter().take(n_bases).enumerate().skip(exact) {
        let bytes = f64::from(4 * settings.basis.words());
        rows.push(Row::new(format!("light of a probe, {name}"), bytes, "bytes"));
        let error = 100.0 * relative_difference(&pictures[ix], &pictures[exact]);
        rows.push(Row::new(format!("difference from f32, {name}"), error, "%"));
    }
    let bytes = f64::from(4 * ours.basis.words());
    rows.push(Row::new(format!("light of a probe, {DEFAULT}"), bytes, "bytes"));
    let error = 100.0 * relative_difference(&pictures[0], &pictures[exact]);
    rows.push(Row::new(format!("difference from f32, {DEFAULT}"), error, "%"));
    for ix in [0, n_bases, n_bases + 1] {
        let name = if ix == 0 { "all cells" } else { configurations[ix].0 };
        let stats = rigs[ix].technique.stats();
        let stat = |name: &str| match stats.iter().find(|stat| stat.name == name) {
            Some(stat) => read_stat(gpu, stat),
            None => Ok(0),
        };
        let n_probes = stat("probes")? as f64;
        let gather = sum_of(&all[ix], &["probes/gather"]);
        rows.push(Row::new(format!("probes, {name}"), n_probes, ""));
        rows.push(Row::new(
            format!("probes, {name}: bytes for look-ups"),
            n_probes * rigs[ix].technique.probes().probe_bytes() as f64 / 1e6,
            "MB",
        ));
        let n_paths = n_probes * f64::from(PATHS_PER_UPDATE);
        rows.push(Row::new(
            format!("gathering, {name}"),
            n_paths / gather / 1e3,
            "million paths/s",
        ));
        rows.push(Row::new(format!("packing, {name}"), sum_of(&all[ix], &["probes/pack"]), "ms"));
        rows.push(Row::new(format!("placing, {name}"), sum_of(&all[ix], &["probes/place"]), "ms"));
    }
    Ok(rows)
}

/// Root of the mean squared difference, divided by the mean.
fn relative_difference(found: &[Vec3], expected: &[Vec3]) -> f64 {
    let n = 3.0 * found.len().max(1) as f64;
    let squares: f64 =
        found.iter().zip(expected).map(|(a, b)| f64::from((*a - *b).length_squared())).sum();
    let sum: f64 = expected.iter().map(|rgb| f64::from(rgb.element_sum())).sum();
    (squares / n).sqrt() / (sum / n).max(f64::MIN_POSITIVE)
}
