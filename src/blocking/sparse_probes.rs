// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bakes of sparse probes.

use super::{PlaceNetError, is_free, nearest_hits, read_buffer, voxels_of, words};
use crate::components::lightmap::{
    LightmapError, LightmapSettings, LightmapUvs, NO_CHART, SurfacePoint, unwrap,
};
use crate::components::probe_net::InspectPass;
use crate::components::sparse_probes::{
    BakedCluster, LightmapField, LookPass, Receiver, SparseBake, SparsePlan, SparseSettings,
    SparseSurfaces, Support, TransportPasses, clustered, hash_of_places, least_seeing,
    most_of_cluster, places_of, radius_at,
};
use crate::components::voxels::{Resolution, grid_for_bounds};
use crate::gpu::{Gpu, GpuError, Recorder, storage_buffer};
use crate::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use crate::scene::SceneFingerprint;
use crate::seam::{SceneSeam, StaticMesh};
use glam::{DVec2, Vec2, Vec3};
use std::collections::BinaryHeap;
use std::ops::Range;
use std::sync::mpsc;

/// A scene to bake: what kernels see, and its meshes.
#[derive(Clone, Copy)]
pub struct SparseScene<'a> {
    /// What kernels see.
    pub seam: &'a dyn SceneSeam,
    /// Its surfaces.
    pub meshes: &'a [StaticMesh],
    /// For each triangle of the seam, which one of the meshes it is.
    pub order: &'a [u32],
    /// What bakes know it by.
    pub fingerprint: SceneFingerprint,
}

/// How far a bake is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum BakeStage {
    /// Texture coordinates are made.
    Unwrapping,
    /// Probes are placed.
    Placing,
    /// It is found out which probes see which receivers: steps done, and in all.
    Looking(u32, u32),
    /// Transport is computed: clusters done, and in all.
    Transport(u32, u32),
}

/// Sparse probes could not be baked.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SparseBakeError {
    /// Texture coordinates could not be made.
    #[error(transparent)]
    Lightmap(#[from] LightmapError),
    /// Probes could not be placed.
    #[error(transparent)]
    Place(#[from] PlaceNetError),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The device was lost.
    #[error(transparent)]
    Lost(#[from] super::LostGpu),
    /// Something else.
    #[error("{0}")]
    Failed(String),
    /// It was stopped.
    #[error("stopped")]
    Stopped,
    /// What is done could not be kept.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Candidates for each probe that is placed, and in all, at least.
const CANDIDATES_PER_PROBE: usize = 16;
const LEAST_CANDIDATES: usize = 2048;
/// Samples of what receivers see, by which probes are placed.
const N_SAMPLES: usize = 4096;
/// Texels of a chart that are asked whether a candidate sees them, and how many candidates each asks.
const TEXELS_PER_CHART: usize = 8;
const ASKED: usize = 24;
/// So many of them are asked, before it is looked whether more are needed.
const ASKED_AT_ONCE: usize = 8;
/// Rays from texels of charts that no candidate sees. If one of so many ends at what candidates see, the chart is lit.
const GLANCES: usize = 8;
const GLANCES_PER_SEEN: usize = 4;
/// How much samples count from the back of one surface to that of another: they may be in a solid that the file calls double-sided. (Not 0: they may also be in
/// a room whose walls are turned around.)
const SHARE_OF_BACKS: f32 = 0.25;
/// How much samples count that see the sky: probes pass on what surfaces reflect; pixels and receivers find the sky themselves.
const SHARE_OF_SKY: f32 = 0.1;
/// Rays that are traced at once.
const RAYS_AT_ONCE: usize = 1 << 20;
/// Receivers whose surroundings are looked at at once.
const RECEIVERS_AT_ONCE: usize = 1 << 16;
/// Radii that are tried, in units of the edge of a square of as much surface as there is for each probe; the share of samples that may be without a
/// probe, beyond those that no candidate sees; and how many see one in the mean, at least: with two, their edges show as arcs.
const RADII: [f32; 7] = [0.3, 0.42, 0.6, 0.72, 0.85, 1.2, 1.7];
const UNSEEN: f64 = 0.03;
const LEAST_MEAN: f64 = 2.5;

/// The number for which there are candidates, if none is chosen. (With three quarters of it, the conference room's light is 2.3 instead of 2.1 of L* off.)
const USUAL_COUNT: usize = 256;
/// Numbers of probes that are tried until they count as far as surfaces see each other in the mean, or nearer, if none is chosen.
const COUNTS: [usize; 7] = [64, 96, 128, 192, 256, 384, 512];
/// Candidates whose rays are in memory at once.
const CANDIDATES_AT_ONCE: usize = 256;

/// Everything that a bake decides before it computes transport: texture coordinates, receivers, probes, clusters. `placed`: where the probes are
/// \[m\]; None: they are placed by themselves. Remarks are added to `notes`.
///
/// # Errors
/// [`SparseBakeError`]
pub fn plan_sparse_probes(
    gpu: &Gpu,
    scene: &SparseScene,
    settings: SparseSettings,
    placed: Option<&[Vec3]>,
    notes: &mut Vec<String>,
    keep_going: &(dyn Fn(BakeStage) -> bool + Sync),
) -> Result<SparsePlan, SparseBakeError> {
    let go_on = |stage| if keep_going(stage) { Ok(()) } else { Err(SparseBakeError::Stopped) };
    go_on(BakeStage::Unwrapping)?;
    let of_lightmap = LightmapSettings {
        n_texels: settings.n_texels,
        uses_second_uv: settings.uses_second_uv,
        ..LightmapSettings::default()
    };
    let uvs = unwrap(scene.meshes, &of_lightmap, &|| keep_going(BakeStage::Unwrapping))?;
    notes.extend(uvs.notes.iter().cloned());
    if uvs.n_without_chart() > 0 {
        notes.push(format!(
            "{} of {} triangles are too thin for texture coordinates, and read the probes themselves",
            uvs.n_without_chart(),
            uvs.charts.len()
        ));
    }
    let surfaces = SparseSurfaces::new(scene.meshes, uvs.size, &uvs.corners);
    go_on(BakeStage::Placing)?;
    let candidates = match placed {
        Some(points) => given(gpu, scene, points, notes)?,
        None if settings.n_probes == 0 => candidates(gpu, scene, USUAL_COUNT)?,
        None => candidates(gpu, scene, settings.n_probes as usize)?,
    };
    let lit_sides = lit_sides(gpu, scene, &uvs, &surfaces, &candidates)?;
    let mut receivers: Vec<Receiver> = Vec::new();
    let texels = surfaces.texels();
    for (ix, [x, y]) in texels.texels.iter().enumerate() {
        let point = texels.points_of(ix)[0];
        let chart = uvs.charts[point.triangle as usize] as usize;
        for side in (0..2).filter(|side| lit_sides[chart][*side as usize]) {
            receivers.push(Receiver {
                triangle: point.triangle,
                weights: point.weights,
                texel: u32::from(*x) | u32::from(*y) << 16,
                side,
            });
        }
    }
    go_on(BakeStage::Placing)?;
    let wanted = Wanted {
        counts: match (placed, settings.n_probes) {
            (Some(points), _) => vec![points.len().max(1)],
            (None, 0) => COUNTS.to_vec(),
            (None, n) => vec![n as usize],
        },
        takes_all: placed.is_some(),
        radius: Some(settings.radius).filter(|radius| *radius > 0.0),
        area: receivers.len() as f32 / uvs.texels_per_metre.powi(2),
    };
    let (probes, coverage, radius, sight) =
        chosen(gpu, scene, &surfaces, &receivers, candidates, &wanted)?;
    if f64::from(radius) > sight {
        notes.push(format!(
            "probes count {radius:.2} m far, and surfaces see each other {sight:.2} m far in the mean: more probes or a smaller radius blur light less"
        ));
    }
    let positions: Vec<Vec3> = receivers.iter().map(|of| surfaces.position(of)).collect();
    let most = most_of_cluster(&settings, probes.len());
    let (order, clusters) = clustered(&positions, most);
    let receivers: Vec<Receiver> = order.iter().map(|ix| receivers[*ix as usize]).collect();
    let of_radius = (radius, settings.support);
    let radii = radii_of(gpu, scene, &surfaces, &receivers, &probes, of_radius)?;
    let texel = 1.0 / uvs.texels_per_metre;
    let anchors = anchors_of(gpu, scene, &surfaces, &receivers, texel)?;
    let mut plan = SparsePlan {
        scene: scene.fingerprint,
        settings,
        size: uvs.size,
        texels_per_metre: uvs.texels_per_metre,
        radius,
        placed: placed.map_or(0, hash_of_places),
        radii,
        corners: uvs.corners,
        probes,
        reach: reach_of(gpu, scene, &surfaces, &receivers, &anchors, texel)?,
        receivers,
        clusters,
        seen: Vec::new(),
        coverage,
    };
    plan.seen = seen(gpu, scene, &anchors, &plan)?;
    Ok(plan)
}

/// Those of given points that are free.
fn given(
    gpu: &Gpu,
    scene: &SparseScene,
    points: &[Vec3],
    notes: &mut Vec<String>,
) -> Result<Vec<Vec3>, SparseBakeError> {
    let inspect = InspectPass::new(gpu, scene.seam);
    let is_free = is_free(gpu, scene.seam, &inspect, points, f32::MAX)?;
    let free: Vec<Vec3> =
        points.iter().zip(&is_free).filter(|(_, free)| **free).map(|(p, _)| *p).collect();
    if free.len() < points.len() {
        notes.push(format!(
            "{} of {} given probes are inside something, and are left out",
            points.len() - free.len(),
            points.len()
        ));
    }
    Ok(free)
}

/// Places where probes could be: the middles of empty voxels beside occupied ones, of voxels so small that there are enough.
fn candidates(
    gpu: &Gpu,
    scene: &SparseScene,
    n_probes: usize,
) -> Result<Vec<Vec3>, SparseBakeError> {
    let facts = scene.seam.facts();
    let inspect = InspectPass::new(gpu, scene.seam);
    let mut found: Vec<Vec3> = Vec::new();
    for n in [6, 9, 13, 19, 27, 38, 54, 76, 108] {
        // (A margin of 1.5 voxels on both sides.)
        let (low, high) = (facts.bounds_min, facts.bounds_max);
        let grid = grid_for_bounds(low, high, Resolution::Longest(n + 3), 1, None)
            .map_err(PlaceNetError::from)?;
        let points = voxels_of(gpu, scene.seam, grid)?.beside_surfaces();
        let is_free = is_free(gpu, scene.seam, &inspect, &points, 4.0 * grid.cell)?;
        let free: Vec<Vec3> =
            points.into_iter().zip(is_free).filter_map(|(p, free)| free.then_some(p)).collect();
        let is_enough = free.len() >= LEAST_CANDIDATES.max(CANDIDATES_PER_PROBE * n_probes);
        if free.len() > found.len() {
            found = free;
        }
        if is_enough {
            break;
        }
    }
    Ok(found)
}

/// How far rays start from surfaces, of the scene's diagonal.
const OFFSET: f32 = 2e-5;

/// Which sides of each chart a candidate sees: only these get receivers. Without candidates, all of them.
fn lit_sides(
    gpu: &Gpu,
    scene: &SparseScene,
    uvs: &LightmapUvs,
    surfaces: &SparseSurfaces,
    candidates: &[Vec3],
) -> Result<Vec<[bool; 2]>, SparseBakeError> {
    let mut out = vec![[candidates.is_empty(); 2]; uvs.n_charts as usize];
    if candidates.is_empty() {
        return Ok(out);
    }
    let texels = surfaces.texels();
    let mut of_chart: Vec<Vec<u32>> = vec![Vec::new(); uvs.n_charts as usize];
    for ix in 0..texels.len() {
        let chart = uvs.charts[texels.points_of(ix)[0].triangle as usize];
        if chart != NO_CHART {
            of_chart[chart as usize].push(ix as u32);
        }
    }
    let offset = OFFSET * scene.seam.facts().diagonal();
    let mut asked: Vec<Receiver> = Vec::new();
    let mut charts = Vec::new();
    for (chart, texels_of) in of_chart.iter().enumerate() {
        let n = texels_of.len().min(TEXELS_PER_CHART);
        for k in 0..n {
            let texel = texels_of[(2 * k + 1) * texels_of.len() / (2 * n)];
            let point = texels.points_of(texel as usize)[0];
            let SurfacePoint { triangle, weights } = point;
            for side in 0..2 {
                asked.push(Receiver { triangle, weights, texel: 0, side });
                charts.push(chart);
            }
        }
    }
    let is_seen =
        seen_from_near(gpu, scene, surfaces, &asked.iter().collect::<Vec<_>>(), candidates)?;
    for ((receiver, chart), is_seen) in asked.iter().zip(&charts).zip(is_seen) {
        out[*chart][receiver.side as usize] |= is_seen;
    }
    // What is in a corner that no candidate sees, but sees what candidates see, is lit as well: leaves in a bush, for example.
    for _ in 0..2 {
        let still: Vec<(Receiver, usize)> = asked
            .iter()
            .zip(&charts)
            .filter(|(of, chart)| !out[**chart][of.side as usize])
            .map(|(of, chart)| (*of, *chart))
            .collect();
        let rays: Vec<Ray> = still
            .iter()
            .enumerate()
            .flat_map(|(ix, (of, _))| {
                (0..GLANCES).map(move |k| hemisphere_ray(surfaces, of, GLANCES * ix + k, offset))
            })
            .collect();
        let hits = nearest_hits(gpu, scene.seam, &rays)?;
        let mut seen = vec![[0usize; 2]; out.len()];
        let mut n_asked = seen.clone();
        for (k, (ray, hit)) in rays.iter().zip(&hits).enumerate() {
            let (of, chart) = &still[k / GLANCES];
            n_asked[*chart][of.side as usize] += 1;
            if hit.triangle == NONE {
                continue;
            }
            let triangle = scene.order[hit.triangle as usize] as usize;
            let normal = normal_of(&surfaces.corners[triangle]);
            let side = usize::from(normal.dot(ray.direction) > 0.0);
            let is_lit = out.get(uvs.charts[triangle] as usize).is_some_and(|lit| lit[side]);
            seen[*chart][of.side as usize] += usize::from(is_lit);
        }
        for (chart, lit) in out.iter_mut().enumerate() {
            for side in 0..2 {
                let (seen, asked) = (seen[chart][side], n_asked[chart][side]);
                lit[side] |= asked > 0 && GLANCES_PER_SEEN * seen >= asked;
            }
        }
    }
    Ok(out)
}

fn normal_of(corners: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

/// A cosine-distributed ray from a receiver, number `ix` of a sequence.
fn hemisphere_ray(surfaces: &SparseSurfaces, of: &Receiver, ix: usize, offset: f32) -> Ray {
    let normal = surfaces.normal(of);
    let u = r_two(ix);
    let (radius, angle) = (u.x.sqrt(), std::f32::consts::TAU * u.y);
    let (x, y) = normal.any_orthonormal_pair();
    let height = (1.0 - u.x).max(0.0).sqrt();
    let direction = radius * (angle.cos() * x + angle.sin() * y) + height * normal;
    let origin = surfaces.position(of) + normal * offset;
    Ray { origin, t_min: 0.0, direction, t_max: f32::MAX }
}

/// Whether some places on surfaces are seen by one of the nearest candidates in front of them.
fn seen_from_near(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    asked: &[&Receiver],
    candidates: &[Vec3],
) -> Result<Vec<bool>, SparseBakeError> {
    let seen = distances_of_seen(gpu, scene, surfaces, asked, candidates, 0..ASKED)?;
    Ok(seen.iter().map(|of| !of.is_empty()).collect())
}

/// For each of some places on surfaces, which of the nearest points in front of it see it: their distances \[m\], in order. `which`: of the points in order
/// of their distance, those that are asked.
fn distances_of_seen(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    asked: &[&Receiver],
    points: &[Vec3],
    which: Range<usize>,
) -> Result<Vec<Vec<f32>>, SparseBakeError> {
    let offset = OFFSET * scene.seam.facts().diagonal();
    let mut out: Vec<Vec<f32>> = vec![Vec::new(); asked.len()];
    for first in (0..asked.len()).step_by(RECEIVERS_AT_ONCE) {
        let end = (first + RECEIVERS_AT_ONCE).min(asked.len());
        let (mut rays, mut asked_by) = (Vec::new(), Vec::new());
        for (ix, receiver) in (first..end).zip(&asked[first..end]) {
            let (at, normal) = (surfaces.position(receiver), surfaces.normal(receiver));
            let mut near: Vec<(f32, Vec3)> = points
                .iter()
                .filter(|of| (**of - at).dot(normal) > 0.0)
                .map(|of| (of.distance(at), *of))
                .collect();
            if near.len() > which.end {
                near.select_nth_unstable_by(which.end, |a, b| a.0.total_cmp(&b.0));
                near.truncate(which.end);
            }
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            let origin = at + normal * offset;
            for (distance, point) in near.into_iter().skip(which.start) {
                rays.push(Ray { origin, t_min: 0.0, direction: point - origin, t_max: 1.0 });
                asked_by.push((ix, distance));
            }
        }
        let blocked = any_hits(gpu, scene.seam, &rays)?;
        for ((ix, distance), blocked) in asked_by.into_iter().zip(blocked) {
            if !blocked {
                out[ix].push(distance);
            }
        }
    }
    Ok(out)
}

/// [`SparsePlan::radii`]: so large that enough probes count that see the receiver. (Those in the next room, or inside a piece of furniture, do not help it.)
fn radii_of(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    receivers: &[Receiver],
    probes: &[Vec3],
    (radius, support): (f32, Support),
) -> Result<Vec<f32>, SparseBakeError> {
    let least = least_seeing(support);
    let mut seen: Vec<Vec<f32>> = vec![Vec::new(); receivers.len()];
    let mut still: Vec<usize> = (0..receivers.len()).collect();
    for first in (0..ASKED).step_by(ASKED_AT_ONCE) {
        let asked: Vec<&Receiver> = still.iter().map(|ix| &receivers[*ix]).collect();
        let which = first..first + ASKED_AT_ONCE;
        let more = distances_of_seen(gpu, scene, surfaces, &asked, probes, which)?;
        for (ix, more) in still.iter().zip(more) {
            seen[*ix].extend(more);
        }
        still.retain(|ix| seen[*ix].len() < least);
    }
    let of = |(receiver, seen): (&Receiver, &Vec<f32>)| {
        radius_at(surfaces.position(receiver), probes, seen, radius, support)
    };
    Ok(receivers.iter().zip(&seen).map(of).collect())
}

/// Whether each ray hits anything.
fn any_hits(gpu: &Gpu, scene: &dyn SceneSeam, rays: &[Ray]) -> Result<Vec<bool>, SparseBakeError> {
    let kernel = RayKernel::new(gpu, scene, RayQuestion::Any);
    let copied = wgpu::BufferUsages::COPY_DST;
    let mut out = Vec::with_capacity(rays.len());
    for some in rays.chunks(RAYS_AT_ONCE) {
        let bytes: &[u8] = bytemuck::cast_slice(some);
        let advice = "use fewer probes";
        let asked = storage_buffer(gpu, "rays", bytes.len() as u64, copied, advice)?;
        gpu.queue.write_buffer(&asked, 0, bytes);
        let none = wgpu::BufferUsages::empty();
        let answers = storage_buffer(gpu, "answers", 4 * some.len() as u64, none, advice)?;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let mut recorder = Recorder::new(gpu, &mut encoder);
        kernel
            .record(&mut recorder, scene, &asked, &answers, some.len() as u32)
            .map_err(|error| SparseBakeError::Failed(error.to_string()))?;
        drop(recorder);
        gpu.queue.submit([encoder.finish()]);
        let found: Vec<u32> = words(&read_buffer(gpu, &answers)?);
        out.extend(found[..some.len()].iter().map(|blocked| *blocked != 0));
    }
    Ok(out)
}

/// What a receiver sees in one direction.
struct Sample {
    from: Vec3,
    /// How much it counts.
    share: f32,
    /// The point that is hit, moved off its surface, and the normal towards the receiver; or the direction to the sky.
    target: Result<(Vec3, Vec3), Vec3>,
}

/// Point `ix` of the R2 sequence (M. Roberts, 2018) in the unit square.
fn r_two(ix: usize) -> Vec2 {
    let of = |a: f64| (0.5 + ix as f64 * a).fract() as f32;
    Vec2::new(of(0.754_877_666_246_692_7), of(0.569_840_290_998_053_3))
}

fn samples(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    receivers: &[Receiver],
    candidates: &[Vec3],
) -> Result<Vec<Sample>, SparseBakeError> {
    let offset = OFFSET * scene.seam.facts().diagonal();
    // (Places that nobody can see, inside solids for example, are not asked what they see.)
    let n = N_SAMPLES.min(16 * receivers.len());
    let asked: Vec<&Receiver> = (0..n).map(|k| &receivers[k * receivers.len() / n]).collect();
    let is_seen = seen_from_near(gpu, scene, surfaces, &asked, candidates)?;
    let asked: Vec<(usize, &Receiver)> =
        asked.into_iter().enumerate().filter(|(k, _)| is_seen[*k]).collect();
    let rays: Vec<Ray> =
        asked.iter().map(|(k, of)| hemisphere_ray(surfaces, of, *k, offset)).collect();
    let hits = nearest_hits(gpu, scene.seam, &rays)?;
    let sample = |((ray, hit), (_, of)): ((&Ray, &Hit), &(usize, &Receiver))| {
        if hit.triangle == NONE {
            return Sample { from: ray.origin, share: SHARE_OF_SKY, target: Err(ray.direction) };
        }
        let triangle = scene.order[hit.triangle as usize] as usize;
        let normal = normal_of(&surfaces.corners[triangle]);
        let is_back = normal.dot(ray.direction) > 0.0;
        let normal = if is_back { -normal } else { normal };
        let at = ray.origin + hit.t * ray.direction + offset * normal;
        let share = if is_back && of.side == 1 { SHARE_OF_BACKS } else { 1.0 };
        Sample { from: ray.origin, share, target: Ok((at, normal)) }
    };
    Ok(rays.iter().zip(&hits).zip(&asked).map(sample).collect())
}

/// Which probes are wanted.
struct Wanted {
    /// How many, at most; of several numbers, the first one that is enough.
    counts: Vec<usize>,
    /// All candidates, instead.
    takes_all: bool,
    /// Within which they count \[m\]; None: one of [`RADII`].
    radius: Option<f32>,
    /// Of the surfaces \[m²\].
    area: f32,
}

impl Wanted {
    /// Radii that are tried with a number of probes, in order.
    fn radii(&self, count: usize) -> Vec<f32> {
        let spacing = (self.area / count as f32).sqrt();
        self.radius.map_or_else(|| RADII.map(|of| of * spacing).to_vec(), |chosen| vec![chosen])
    }

    fn widest(&self) -> f32 {
        self.counts.iter().flat_map(|count| self.radii(*count)).fold(0.0, f32::max)
    }
}

/// Probes that have been chosen.
#[derive(Default)]
struct Chosen {
    kept: Vec<usize>,
    /// Which samples one of them sees.
    is_seen: Vec<bool>,
    radius: f32,
    /// Few samples are without a probe, and they have enough of them in the mean.
    is_enough: bool,
}

/// The probes among candidates that see most of what receivers see: greedily, those that add most. Each sample counts one if a probe sees it, and up
/// to one more the nearer that probe is to the receiver. (The sum is submodular, so that the greedy choice is at least 63 % of the best one: G.
/// Nemhauser, L. Wolsey, M. Fisher, 1978.) Returns also how many samples there are of surfaces, how many of these no probe sees, the radius within
/// which probes count, and how far surfaces see each other in the mean \[m\].
fn chosen(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    receivers: &[Receiver],
    candidates: Vec<Vec3>,
    wanted: &Wanted,
) -> Result<(Vec<Vec3>, [u32; 2], f32, f64), SparseBakeError> {
    if receivers.is_empty() || candidates.is_empty() {
        return Ok((candidates, [0, 0], wanted.widest(), f64::INFINITY));
    }
    let samples = samples(gpu, scene, surfaces, receivers, &candidates)?;
    let sees = seen_samples(gpu, scene, &samples, &candidates, wanted.widest())?;
    let mut is_possible = vec![false; samples.len()];
    sees.iter().flatten().for_each(|(sample, _)| is_possible[*sample as usize] = true);
    let shares: Vec<f32> = samples.iter().map(|of| of.share).collect();
    let sight = mean_sight(&samples);
    let mut best = Chosen::default();
    for &count in &wanted.counts {
        let most = (!wanted.takes_all).then_some(count);
        best = with_radius(&sees, &shares, &is_possible, &wanted.radii(count), most);
        if best.is_enough && (wanted.radius.is_some() || f64::from(best.radius) <= sight) {
            break;
        }
    }
    let probes = best.kept.iter().map(|ix| candidates[*ix]).collect();
    let of_surfaces = || samples.iter().zip(&best.is_seen).filter(|(of, _)| of.target.is_ok());
    let n_unseen = of_surfaces().filter(|(_, is_seen)| !**is_seen).count();
    Ok((probes, [of_surfaces().count() as u32, n_unseen as u32], best.radius, sight))
}

/// How far surfaces see each other, in the mean \[m\]; as far as you like, if they see the sky alone.
fn mean_sight(samples: &[Sample]) -> f64 {
    let of = |sample: &Sample| {
        let (at, _) = sample.target.ok()?;
        Some(f64::from(sample.share) * DVec2::new(at.distance(sample.from).into(), 1.0))
    };
    let sum: DVec2 = samples.iter().filter_map(of).sum();
    if sum.y > 0.0 { sum.x / sum.y } else { f64::INFINITY }
}

/// For each candidate the samples that it sees, and the distances of their receivers, below `widest` \[m\].
fn seen_samples(
    gpu: &Gpu,
    scene: &SparseScene,
    samples: &[Sample],
    candidates: &[Vec3],
    widest: f32,
) -> Result<Vec<Vec<(u32, f32)>>, SparseBakeError> {
    let mut out: Vec<Vec<(u32, f32)>> = vec![Vec::new(); candidates.len()];
    for (some, known) in
        candidates.chunks(CANDIDATES_AT_ONCE).zip(out.chunks_mut(CANDIDATES_AT_ONCE))
    {
        let (mut rays, mut pairs): (Vec<Ray>, Vec<(usize, u32, f32)>) = Default::default();
        for (ix, candidate) in some.iter().enumerate() {
            for (sample_ix, sample) in (0u32..).zip(samples) {
                let distance = candidate.distance(sample.from);
                if distance >= widest {
                    continue;
                }
                let ray = match sample.target {
                    Ok((at, normal)) if (*candidate - at).dot(normal) > 0.0 => {
                        Ray { origin: at, t_min: 0.0, direction: *candidate - at, t_max: 1.0 }
                    }
                    Ok(_) => continue,
                    Err(direction) => {
                        Ray { origin: *candidate, t_min: 0.0, direction, t_max: f32::MAX }
                    }
                };
                rays.push(ray);
                pairs.push((ix, sample_ix, distance));
            }
        }
        let blocked = any_hits(gpu, scene.seam, &rays)?;
        for ((candidate, sample, distance), blocked) in pairs.into_iter().zip(blocked) {
            if !blocked {
                known[candidate].push((sample, distance));
            }
        }
    }
    Ok(out)
}

/// The first radius that is enough for so many probes, or the one with which most samples are seen.
fn with_radius(
    sees: &[Vec<(u32, f32)>],
    shares: &[f32],
    is_possible: &[bool],
    radii: &[f32],
    most: Option<usize>,
) -> Chosen {
    // What is lacking of samples, all their shares together.
    let lacking = |is_there: &dyn Fn(usize) -> bool| -> f64 {
        (0..shares.len()).filter(|ix| !is_there(*ix)).map(|ix| f64::from(shares[ix])).sum()
    };
    let all = lacking(&|_| false);
    let limit = lacking(&|ix| is_possible[ix]) + UNSEEN * all;
    let mut best = Chosen::default();
    let mut least = f64::INFINITY;
    for &radius in radii {
        let (kept, is_seen) = greedy(sees, shares, radius, most);
        let unseen = lacking(&|ix| is_seen[ix]);
        let n_seeing: f64 = kept
            .iter()
            .flat_map(|ix| &sees[*ix])
            .filter(|(_, distance)| *distance < radius)
            .map(|(sample, _)| f64::from(shares[*sample as usize]))
            .sum();
        let is_enough = unseen <= limit && n_seeing >= LEAST_MEAN * all;
        if unseen < least || is_enough {
            least = unseen;
            best = Chosen { kept, is_seen, radius, is_enough };
        }
        if is_enough {
            break;
        }
    }
    best
}

/// Which of some candidates are kept, and which samples one of them sees. `sees`: for each candidate, the samples that it sees, and the distances of
/// their receivers; `shares`: how much each sample counts.
fn greedy(
    sees: &[Vec<(u32, f32)>],
    shares: &[f32],
    radius: f32,
    most: Option<usize>,
) -> (Vec<usize>, Vec<bool>) {
    let value = |distance: f32| {
        let t = distance / radius;
        if t < 1.0 { 2.0 + (2.0 * t - 3.0) * t * t } else { 0.0 }
    };
    let mut best = vec![0.0f32; shares.len()];
    let mut kept = Vec::new();
    let gain = |known: &[(u32, f32)], best: &[f32]| -> f64 {
        let of = |&(ix, distance): &(u32, f32)| {
            let ix = ix as usize;
            f64::from(shares[ix]) * f64::from((value(distance) - best[ix]).max(0.0))
        };
        known.iter().map(of).sum()
    };
    // (Gains only fall, so that the largest of old gains is worth asking first.)
    let mut heap: BinaryHeap<Gain> =
        (0..sees.len()).map(|ix| Gain(gain(&sees[ix], &best), ix)).collect();
    while let Some(Gain(_, ix)) = heap.pop() {
        if most.is_some_and(|most| kept.len() >= most) {
            break;
        }
        let now = gain(&sees[ix], &best);
        if most.is_some() && heap.peek().is_some_and(|next| now < next.0) {
            heap.push(Gain(now, ix));
            continue;
        }
        if most.is_some() && now <= 0.0 {
            break;
        }
        for (sample, distance) in &sees[ix] {
            let known = &mut best[*sample as usize];
            *known = known.max(value(*distance));
        }
        kept.push(ix);
    }
    kept.sort_unstable();
    (kept, best.iter().map(|value| *value > 0.0).collect())
}

/// What a candidate adds, and which one it is.
struct Gain(f64, usize);

impl PartialEq for Gain {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}
impl Eq for Gain {}
impl PartialOrd for Gain {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Gain {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// How far points are lifted off their surfaces before it is asked whether one sees the other, in texels: less than surfaces bend within one.
const LIFT: f32 = 0.1;

/// The points that stand for receivers, off their surfaces: by [`LIFT`], or half as far as whatever leans over them. `texel`: how wide it is \[m\].
fn anchors_of(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    receivers: &[Receiver],
    texel: f32,
) -> Result<Vec<Vec3>, SparseBakeError> {
    let offset = OFFSET * scene.seam.facts().diagonal();
    let mut out = Vec::with_capacity(receivers.len());
    for some in receivers.chunks(RAYS_AT_ONCE) {
        let ray = |of: &Receiver| {
            let direction = surfaces.normal(of);
            let origin = surfaces.position(of) + offset * direction;
            Ray { origin, t_min: 0.0, direction, t_max: LIFT * texel }
        };
        let rays: Vec<Ray> = some.iter().map(ray).collect();
        let hits = nearest_hits(gpu, scene.seam, &rays)?;
        out.extend(rays.iter().zip(&hits).map(|(ray, hit)| {
            let lift = if hit.triangle == NONE { ray.t_max } else { 0.5 * hit.t };
            ray.origin + lift * ray.direction
        }));
    }
    Ok(out)
}

/// [`SparsePlan::reach`]: rays from the point that stands for a receiver to the others in its texel, and to those that stand for its neighbours.
fn reach_of(
    gpu: &Gpu,
    scene: &SparseScene,
    surfaces: &SparseSurfaces,
    receivers: &[Receiver],
    anchors: &[Vec3],
    texel: f32,
) -> Result<Vec<u32>, SparseBakeError> {
    let lift = LIFT * texel;
    let mut at_texel = std::collections::HashMap::new();
    for (ix, of) in receivers.iter().enumerate() {
        at_texel.insert((of.texel, of.side), ix);
    }
    // (Places without a point are asked by nobody.)
    let mut out = vec![0u32; receivers.len()];
    for first in (0..receivers.len()).step_by(RECEIVERS_AT_ONCE) {
        let some = first..(first + RECEIVERS_AT_ONCE).min(receivers.len());
        let (mut rays, mut bits, mut known) = (Vec::new(), Vec::new(), Vec::new());
        for ix in some {
            let receiver = &receivers[ix];
            let from = anchors[ix];
            let mut ask = |to: Option<Vec3>, bit: u32| {
                // (To a point that is the same, nothing is in between. Texels without a receiver have light of their neighbours.)
                let Some(to) = to.filter(|to| to.distance(from) > 1e-3 * lift) else {
                    out[ix] |= 1 << bit;
                    return;
                };
                rays.push(Ray { origin: from, t_min: 0.0, direction: to - from, t_max: 1.0 });
                bits.push((ix, bit));
            };
            let mut is_unknown = 0xffffu32;
            let places = surfaces.places_of(receiver);
            for (point, place) in surfaces.points_of(receiver).iter().zip(places) {
                if *place > 15 {
                    continue;
                }
                is_unknown &= !(1 << place);
                let (triangle, weights) = (point.triangle, point.weights);
                let own = Receiver { triangle, weights, ..*receiver };
                ask(Some(surfaces.anchor(&own, lift)), u32::from(*place));
            }
            known.push((ix, is_unknown));
            let (x, y) = (receiver.texel & 0xffff, receiver.texel >> 16);
            for k in (0..9u32).filter(|k| *k != 4) {
                let at = [x + k % 3, y + k / 3].map(|at| at.wrapping_sub(1));
                let key = (at[0] & 0xffff | at[1] << 16, receiver.side);
                let to = at_texel.get(&key).map(|ix| anchors[*ix]);
                ask(to, 16 + k - u32::from(k > 4));
            }
        }
        known.into_iter().for_each(|(ix, places): (usize, u32)| out[ix] |= places);
        let blocked = any_hits(gpu, scene.seam, &rays)?;
        for ((ix, bit), blocked) in bits.into_iter().zip(blocked) {
            out[ix] |= u32::from(!blocked) << bit;
        }
    }
    Ok(out)
}

/// What the probes see.
fn seen(
    gpu: &Gpu,
    scene: &SparseScene,
    anchors: &[Vec3],
    plan: &SparsePlan,
) -> Result<Vec<u32>, SparseBakeError> {
    let n_probes = plan.probes.len() as u32;
    let n_directions = plan.settings.n_directions;
    let n = n_probes * n_directions;
    if n == 0 {
        return Ok(Vec::new());
    }
    let advice = "use fewer probes";
    let field = LightmapField::new(
        gpu,
        plan.size,
        &plan.corners,
        scene.order,
        (&plan.receivers, &plan.reach),
    )?;
    let lift = LIFT / plan.texels_per_metre;
    let uploaded = |label, points: &[Vec3]| -> Result<wgpu::Buffer, GpuError> {
        let points = places_of(points);
        let bytes: &[u8] = bytemuck::cast_slice(&points);
        let copied = wgpu::BufferUsages::COPY_DST;
        let buffer = storage_buffer(gpu, label, bytes.len() as u64, copied, advice)?;
        gpu.queue.write_buffer(&buffer, 0, bytes);
        Ok(buffer)
    };
    let places = uploaded("places of probes", &plan.probes)?;
    let anchors = uploaded("places of receivers", anchors)?;
    let none = wgpu::BufferUsages::empty();
    let seen = storage_buffer(gpu, "what probes see", 4 * u64::from(n), none, advice)?;
    let pass = LookPass::new(gpu, scene.seam);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let mut recorder = Recorder::new(gpu, &mut encoder);
    pass.record(
        &mut recorder,
        scene.seam,
        &field,
        [&places, &seen, &anchors],
        [n_probes, n_directions],
        lift,
    );
    drop(recorder);
    gpu.queue.submit([encoder.finish()]);
    let found: Vec<u32> = words(&read_buffer(gpu, &seen)?);
    Ok(found[..n as usize].to_vec())
}

/// Computes the transport of those clusters of a bake's part that are missing, and compresses them, while the GPU computes the next one. `keep` is
/// given each, in the order in which they are done, and may write it down; once it returns false, the rest is left out, and the error is
/// [`SparseBakeError::Stopped`].
///
/// # Errors
/// [`SparseBakeError`]
pub fn bake_sparse_probes(
    gpu: &Gpu,
    scene: &SparseScene,
    bake: &mut SparseBake,
    mut keep: impl FnMut(&BakedCluster, &SparsePlan) -> std::io::Result<()>,
    mut keep_going: impl FnMut(BakeStage) -> bool,
) -> Result<(), SparseBakeError> {
    let missing = bake.missing();
    let plan = &bake.plan;
    let surfaces = SparseSurfaces::new(scene.meshes, plan.size, &plan.corners);
    if missing.is_empty() {
        return Ok(());
    }
    let passes = TransportPasses::new(gpu, scene.seam, plan, scene.order)?;
    let submit = |record: &mut dyn FnMut(&mut Recorder)| {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        record(&mut Recorder::new(gpu, &mut encoder));
        gpu.queue.submit([encoder.finish()])
    };
    let n_steps = passes.n_sight_steps();
    for step in 0..n_steps {
        submit(&mut |recorder| passes.record_sight(recorder, scene.seam, step));
        super::wait(gpu)?;
        if !keep_going(BakeStage::Looking(step + 1, n_steps)) {
            return Err(SparseBakeError::Stopped);
        }
    }
    let n_rays = plan.settings.n_rays.next_multiple_of(64).max(64);
    // Begins a cluster: submits all of its samples, and the copy of what they add up to.
    let begin = |cluster: usize| -> Result<_, SparseBakeError> {
        let batch = passes.batch(gpu, plan, &surfaces, cluster)?;
        let (rounds, step) = passes.rounds_and_outputs(&batch);
        let all = 1 + plan.settings.n_radiance();
        let mut first = 0;
        while first < n_rays {
            let n_rounds = rounds.min((n_rays - first) / 64);
            for output in (0..all).step_by(step as usize) {
                let outputs = (output, step.min(all - output));
                submit(&mut |recorder| {
                    passes.record(recorder, scene.seam, &batch, (first, n_rounds), outputs);
                });
            }
            first += 64 * n_rounds;
        }
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("transport, read back"),
            size: batch.sums.size(),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(&batch.sums, 0, &staging, 0, staging.size());
        let submission = gpu.queue.submit([encoder.finish()]);
        Ok((batch, staging, submission))
    };
    let total = missing.len() as u32;
    let mut done: Vec<BakedCluster> = Vec::new();
    let result = std::thread::scope(|scope| -> Result<(), SparseBakeError> {
        let (send_matrix, matrices) =
            mpsc::sync_channel::<crate::components::sparse_probes::Transport>(1);
        let (send_cluster, clusters) = mpsc::channel();
        scope.spawn(move || {
            for transport in matrices {
                if send_cluster.send(transport.compressed(&plan.settings)).is_err() {
                    break;
                }
            }
        });
        let mut take = |cluster: Result<BakedCluster, String>| -> Result<bool, SparseBakeError> {
            let cluster = cluster.map_err(SparseBakeError::Failed)?;
            keep(&cluster, plan)?;
            done.push(cluster);
            Ok(keep_going(BakeStage::Transport(done.len() as u32, total)))
        };
        let mut next = Some(begin(missing[0])?);
        for k in 0..missing.len() {
            let Some((batch, staging, submission)) = next.take() else { break };
            next = missing.get(k + 1).map(|cluster| begin(*cluster)).transpose()?;
            staging.slice(..).map_async(wgpu::MapMode::Read, |_| ());
            let lost = |text: String| SparseBakeError::Lost(super::LostGpu(text));
            gpu.device
                .poll(wgpu::PollType::Wait { submission_index: Some(submission), timeout: None })
                .map_err(|error| lost(error.to_string()))?;
            let view = staging.slice(..).get_mapped_range().map_err(|e| lost(e.to_string()))?;
            let sums: Vec<f32> = words(&view);
            drop(view);
            staging.unmap();
            let transport = batch.matrix(plan, &sums, n_rays).map_err(SparseBakeError::Failed)?;
            if send_matrix.send(transport).is_err() {
                return Err(SparseBakeError::Failed("the thread that compresses has ended".into()));
            }
            while let Ok(cluster) = clusters.try_recv() {
                if !take(cluster)? {
                    return Err(SparseBakeError::Stopped);
                }
            }
        }
        drop(send_matrix);
        for cluster in clusters {
            if !take(cluster)? {
                return Err(SparseBakeError::Stopped);
            }
        }
        Ok(())
    });
    bake.clusters.extend(done);
    bake.clusters.sort_by_key(|cluster| cluster.ix);
    // (Stopped at the very end: all is there.)
    match result {
        Err(SparseBakeError::Stopped) if bake.missing().is_empty() => Ok(()),
        other => other,
    }
}
