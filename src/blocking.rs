// SPDX-License-Identifier: MIT OR Apache-2.0
//! Functions that wait for the GPU, for programs and tests. Nothing else in the library waits.

#[cfg(all(feature = "bake", feature = "nets"))]
mod sparse_probes;

use crate::components::convergence;
#[cfg(feature = "nets")]
use crate::components::probe_net::{
    Candidates, InspectPass, Inspected, NetError, NetRule, NetSettings, PlacedNet,
};
#[cfg(feature = "bake")]
use crate::components::probes::{BakedLayout, BakedProbe, ProbeBake, Probes};
#[cfg(feature = "bake")]
use crate::components::voxels::n_bricks;
#[cfg(feature = "nets")]
use crate::components::voxels::{
    MAX_SIZE, Resolution, Triangles, VoxelError, Voxelizer, grid_for_bounds,
};
#[cfg(any(feature = "bake", feature = "nets"))]
use crate::components::voxels::{VoxelCounts, VoxelGrid};
use crate::frame::{DirectSettings, FrameError, FramePasses, View, ViewSettings};
#[cfg(feature = "nets")]
use crate::gpu::storage_buffer;
use crate::gpu::{AdapterChoice, Gpu, GpuError, PassTimers, Recorder, check_not_empty};
#[cfg(feature = "nets")]
use crate::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use crate::scene::Camera;
#[cfg(feature = "bake")]
use crate::scene::SceneFingerprint;
use crate::seam::{Mismatch, SceneSeam};
use crate::techniques::reference::{
    Film, LongSums, PathCounts, PathTracer, PixelSums, ReferenceSettings, UnfinishedPaths, Work,
};
use crate::techniques::{Stat, StatSource, Technique, TechniqueError};
use std::time::{Duration, Instant};

#[cfg(all(feature = "bake", feature = "nets"))]
pub use sparse_probes::{
    BakeStage, SparseBakeError, SparseScene, bake_sparse_probes, plan_sparse_probes,
};

/// As [`Gpu::open`], but waits.
///
/// # Errors
/// As [`Gpu::open`].
pub fn open(choice: &AdapterChoice) -> Result<(Gpu, wgpu::AdapterInfo), GpuError> {
    pollster::block_on(Gpu::open(choice))
}

/// The GPU stopped responding.
#[derive(Debug, thiserror::Error)]
#[error("the GPU no longer responds: {0}; a driver may have reset it")]
pub struct LostGpu(String);

/// Waits for all submitted work.
///
/// # Errors
/// The device was lost.
pub fn wait(gpu: &Gpu) -> Result<(), LostGpu> {
    let status = gpu.device.poll(wgpu::PollType::wait_indefinitely());
    status.map(|_| ()).map_err(|error| LostGpu(error.to_string()))
}

/// Reads the bytes of a buffer that has `COPY_SRC`, after all submitted work.
///
/// # Errors
/// The device was lost.
pub fn read_buffer(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>, LostGpu> {
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    // A failure shows when the mapped range is requested.
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| ());
    wait(gpu)?;
    let view = staging.slice(..).get_mapped_range().map_err(|e| LostGpu(e.to_string()))?;
    Ok(view.to_vec())
}

/// Reads the film's sums, row by row, lane by lane.
///
/// # Errors
/// The device was lost.
pub fn read_film(gpu: &Gpu, film: &Film) -> Result<Vec<PixelSums>, LostGpu> {
    let mut sums = Vec::new();
    for stripe in film.stripes() {
        let bytes = read_buffer(gpu, &stripe.sums)?;
        sums.extend(
            bytes
                .chunks_exact(size_of::<PixelSums>())
                .map(bytemuck::pod_read_unaligned::<PixelSums>),
        );
    }
    Ok(sums)
}

/// Progress of a rendering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Pixel samples (or frames) done.
    pub done: u64,
    /// Pixel samples (or frames) to do.
    pub total: u64,
}

/// Statistics of a rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct RenderStats {
    /// Samples that every pixel has received.
    pub n_samples: u32,
    /// Number of dispatches.
    pub n_dispatches: u32,
    /// Dispatches among these that continued what the driver had not let the previous one finish.
    pub n_continued: u32,
    /// Samples that were abandoned ([`PathCounts::n_cut`]): their light is missing in the picture.
    pub n_cut: u32,
    /// GPU time of all passes; None if the device has no timestamps.
    pub gpu_time: Option<Duration>,
    /// Time from the first dispatch to the last result.
    pub wall_time: Duration,
    /// Whether it was stopped early.
    pub stopped: bool,
}

/// The reference could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// The scene differs from the one that the path tracer was compiled for.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The picture is empty.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The device was lost.
    #[error(transparent)]
    Lost(#[from] LostGpu),
    /// Samples are missing.
    #[error(
        "pixel {x}, {y} has {found} samples instead of {expected}: the driver did not run the path tracer's loops correctly; try another adapter or driver (--adapter), and please report it"
    )]
    Incomplete {
        /// Column of the first such pixel.
        x: u32,
        /// Its row.
        y: u32,
        /// Samples in the film.
        found: u32,
        /// Requested samples.
        expected: u32,
    },
}

/// How long a dispatch should take: far below the two seconds after which desktop systems reset a GPU, but long enough
/// that the cost of starting it does not matter.
const DISPATCH_TIME: Duration = Duration::from_millis(150);

/// Number of pixels that keeps a device busy; in smaller pictures several invocations share a pixel's samples. Their
/// number depends only on the picture's size, so a picture has the same bytes on every machine that rounds in the same
/// way.
const PIXELS_AT_ONCE: u64 = 1 << 16;
/// The most invocations that share a pixel.
const MAX_LANES: u64 = 64;

/// Samples of a pixel that one invocation adds up in 32-bit floats; then the film is read, and starts from zero again.
/// (The relative error of a sum of n numbers of equal size is at most n·2⁻²⁵: 3e-5 here.)
const MAX_SUMMED: u32 = 1024;

/// Renders `n_samples` for each pixel, in dispatches of about 150 ms, in passes over the whole picture, and returns its
/// sums, row by row.
///
/// `keep_going` is called after each dispatch; once it returns false, the picture is left as it is.
///
/// # Errors
/// [`ReferenceError`]: the picture is empty, the device was lost, or a pixel has not received its samples.
pub fn render_reference(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    camera: &Camera,
    settings: &ReferenceSettings,
    n_samples: u32,
    mut keep_going: impl FnMut(Progress) -> bool,
) -> Result<(Vec<PixelSums>, RenderStats), ReferenceError> {
    check_not_empty(settings.size)?;
    let tracer = PathTracer::new(gpu, scene);
    let n_pixels = u64::from(settings.size.x) * u64::from(settings.size.y);
    let n_lanes = (PIXELS_AT_ONCE / n_pixels).clamp(1, MAX_LANES) as u32;
    let film = Film::with_lanes(gpu, settings.size, n_lanes);
    let unfinished = UnfinishedPaths::new(gpu, &film);
    let mut timers = PassTimers::new(gpu);
    let max_summed = MAX_SUMMED * n_lanes;
    let mut sums = LongSums::new(n_pixels as usize);
    let total = n_pixels * u64::from(n_samples);
    let mut stats =
        RenderStats { gpu_time: timers.as_ref().map(|_| Duration::ZERO), ..Default::default() };
    let mut done = 0;
    let started = Instant::now();
    // Pixel samples per dispatch; the first dispatches are small, because the speed is not known yet.
    let mut budget = 4096.0f64;
    let mut first_sample = 0;
    while first_sample < n_samples && !stats.stopped {
        // As many whole rows as the budget allows; several samples at once if it allows the whole picture.
        let batch = ((budget / n_pixels as f64) as u32)
            .clamp(1, n_samples - first_sample)
            .min(max_summed - first_sample % max_summed);
        'picture: for stripe in 0..film.stripes().len() {
            let (mut row, n_rows) =
                (film.stripes()[stripe].first_row, film.stripes()[stripe].n_rows);
            let end = row + n_rows;
            while row < end {
                let row_samples = f64::from(settings.size.x) * f64::from(batch);
                let rows = ((budget / row_samples) as u32)
                    .next_multiple_of(8)
                    .clamp(8, (end - row).max(8));
                let rows = rows.min(end - row);
                let mut work = Work {
                    stripe,
                    first_row: row,
                    n_rows: rows,
                    first_sample,
                    n_samples: batch,
                    continues: false,
                };
                let begun = Instant::now();
                loop {
                    let mut encoder = gpu.device.create_command_encoder(&Default::default());
                    if let Some(timers) = &mut timers {
                        timers.begin_frame();
                    }
                    let mut recorder = Recorder::timed(gpu, &mut encoder, timers.as_mut());
                    tracer.record(
                        &mut recorder,
                        scene,
                        &film,
                        &unfinished,
                        camera,
                        settings,
                        work,
                    )?;
                    drop(recorder);
                    if let Some(timers) = &timers {
                        timers.resolve(&mut encoder);
                    }
                    gpu.queue.submit([encoder.finish()]);
                    let counts = read_path_counts(gpu, &unfinished)?;
                    if let (Some(timers), Some(sum)) = (&timers, &mut stats.gpu_time) {
                        *sum += read_timers(gpu, timers)?.into_iter().map(|(_, time)| time).sum();
                    }
                    stats.n_dispatches += 1;
                    stats.n_continued += u32::from(work.continues);
                    stats.n_cut = counts.n_cut;
                    work.continues = true;
                    if counts.n_unfinished == 0 {
                        break;
                    }
                }
                let samples = u64::from(rows) * u64::from(settings.size.x) * u64::from(batch);
                done += samples;
                row += rows;
                // At most eight times the work of the last one: the first dispatch also compiles.
                let ideal =
                    samples as f64 * DISPATCH_TIME.as_secs_f64() / begun.elapsed().as_secs_f64();
                budget = ideal.min(samples as f64 * 8.0).max(1024.0);
                if !keep_going(Progress { done, total }) && done < total {
                    stats.stopped = true;
                    break 'picture;
                }
            }
        }
        first_sample += batch;
        if first_sample.is_multiple_of(max_summed) || first_sample >= n_samples || stats.stopped {
            sums.add(&read_film(gpu, &film)?, n_lanes);
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            film.clear(&mut encoder);
            gpu.queue.submit([encoder.finish()]);
        }
        if !stats.stopped {
            stats.n_samples = first_sample;
        }
    }
    stats.wall_time = started.elapsed();
    let sums = sums.rounded();
    // If it was stopped, some pixels have one batch more.
    let is_right = |n: u32| if stats.stopped { n >= stats.n_samples } else { n == n_samples };
    if let Some(ix) = sums.iter().position(|pixel| !is_right(pixel.n_samples)) {
        return Err(ReferenceError::Incomplete {
            x: ix as u32 % settings.size.x,
            y: ix as u32 / settings.size.x,
            found: sums[ix].n_samples,
            expected: stats.n_samples,
        });
    }
    Ok((sums, stats))
}

/// Reads what the last dispatch of the path tracer reported.
///
/// # Errors
/// The device was lost.
pub fn read_path_counts(gpu: &Gpu, unfinished: &UnfinishedPaths) -> Result<PathCounts, LostGpu> {
    let bytes = read_buffer(gpu, unfinished.counts())?;
    Ok(bytemuck::pod_read_unaligned(&bytes[..size_of::<PathCounts>()]))
}

/// Statistics of rendered frames.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct FrameStats {
    /// Frames that were accumulated.
    pub n_frames: u32,
    /// Frames before these.
    pub n_warm_up: u32,
    /// The share of the technique's light that was still on its way at the end of the warm-up, at most; None if it does not know.
    pub light_to_come: Option<f32>,
    /// GPU time of each pass by name, summed over all frames; empty if the device has no timestamps or they were not
    /// requested.
    pub passes: Vec<(&'static str, Duration)>,
    /// Time from the first frame to the last result.
    pub wall_time: Duration,
    /// Whether it was stopped early.
    pub stopped: bool,
    /// Pixels of all frames whose direct light was not finite and was replaced by 0.
    pub n_rejected: u32,
    /// Pixels of all frames whose direct light is wrong because the driver ended loops early: there are too many light
    /// samples for it.
    pub n_cut: u32,
}

/// Which frames to render.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FramesToRender {
    /// Width and height \[pixels\].
    pub size: glam::UVec2,
    /// Near plane, seed, irradiance; its `n_accumulated` is the number of frames.
    pub view: ViewSettings,
    /// Direct light.
    pub direct: DirectSettings,
    /// Frames before these, in which only the technique is updated and no picture is rendered.
    pub n_warm_up: u32,
    /// Ends the warm-up once less than this share of the technique's light is on its way ([`Technique::light_to_come`]), but not before its
    /// 8th frame. 0: `n_warm_up` frames in any case.
    pub settled_below: f32,
    /// Whether to measure GPU times.
    pub timed: bool,
}

impl FramesToRender {
    /// This number of frames of a picture of this size \[pixels\], without warm-up frames.
    pub fn new(size: glam::UVec2, n_frames: u32) -> Self {
        let view = crate::settings!(ViewSettings { n_accumulated: n_frames });
        Self {
            size,
            view,
            direct: DirectSettings::default(),
            n_warm_up: 0,
            settled_below: 0.0,
            timed: false,
        }
    }
}

/// Frames of a warm-up before the technique's light can count as settled: in the first ones, it may not have been found at all.
const LEAST_WARM_UP: u32 = 8;

/// Frames could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FramesError {
    /// The passes could not be created, for example because the picture is too large for the device.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The device was lost.
    #[error(transparent)]
    Lost(#[from] LostGpu),
    /// The technique cannot continue.
    #[error(transparent)]
    Technique(#[from] TechniqueError),
}

/// Renders frames of a still camera, one submission each, and returns the passes with the
/// accumulated picture (`passes.accumulator.film()`).
///
/// `keep_going` is called after each frame; once it returns false, the picture is left as it is.
///
/// # Errors
/// [`FramesError`]
pub fn render_frames(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    camera: &Camera,
    what: &FramesToRender,
    technique: &mut dyn Technique,
    keep_going: impl FnMut(Progress) -> bool,
) -> Result<(FramePasses, FrameStats), FramesError> {
    let passes = FramePasses::new(gpu, scene, what.size, what.direct)?;
    render_frames_with(gpu, scene, camera, what, technique, passes, keep_going)
}

/// As [`render_frames`], with the caller's passes (with other shadows, for example), which must have the requested
/// size.
///
/// # Errors
/// [`FramesError`]
pub fn render_frames_with(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    camera: &Camera,
    what: &FramesToRender,
    technique: &mut dyn Technique,
    mut passes: FramePasses,
    mut keep_going: impl FnMut(Progress) -> bool,
) -> Result<(FramePasses, FrameStats), FramesError> {
    let mut view = View::new(what.size);
    let mut timers = if what.timed { PassTimers::new(gpu) } else { None };
    let mut stats = FrameStats::default();
    let started = Instant::now();
    let n_frames = what.view.n_accumulated.max(1);
    let mut stops = false;
    while stats.n_warm_up < what.n_warm_up {
        view.advance(scene, camera, &what.view);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        passes.update(&mut Recorder::new(gpu, &mut encoder), scene, &view, technique)?;
        gpu.queue.submit([encoder.finish()]);
        wait(gpu)?;
        stats.n_warm_up += 1;
        let total = u64::from(what.n_warm_up) + u64::from(n_frames);
        stops = !keep_going(Progress { done: u64::from(stats.n_warm_up), total });
        if stops {
            break;
        }
        if what.settled_below > 0.0 && stats.n_warm_up >= LEAST_WARM_UP {
            let to_come = read_light_to_come(gpu, technique)?;
            if to_come.is_some_and(|share| share < what.settled_below) {
                break;
            }
        }
    }
    stats.light_to_come = read_light_to_come(gpu, technique)?;
    let total = u64::from(stats.n_warm_up) + u64::from(n_frames);
    view.restart();
    loop {
        view.advance(scene, camera, &what.view);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if let Some(timers) = &mut timers {
            timers.begin_frame();
        }
        let mut recorder = Recorder::timed(gpu, &mut encoder, timers.as_mut());
        passes.record(&mut recorder, scene, &view, technique)?;
        drop(recorder);
        if let Some(timers) = &timers {
            timers.resolve(&mut encoder);
        }
        gpu.queue.submit([encoder.finish()]);
        match &timers {
            Some(timers) => {
                for (name, time) in read_timers(gpu, timers)? {
                    match stats.passes.iter_mut().find(|(known, _)| *known == name) {
                        Some((_, sum)) => *sum += time,
                        None => stats.passes.push((name, time)),
                    }
                }
            }
            None => wait(gpu)?,
        }
        stats.n_frames += 1;
        let done = u64::from(stats.n_warm_up) + u64::from(stats.n_frames);
        let goes_on = keep_going(Progress { done, total });
        if stops || stats.n_frames == n_frames || !goes_on {
            stats.stopped = stops || stats.n_frames < n_frames;
            break;
        }
    }
    stats.wall_time = started.elapsed();
    let faults = read_buffer(gpu, passes.direct.faults())?;
    [stats.n_rejected, stats.n_cut] = bytemuck::pod_read_unaligned(&faults[..8]);
    Ok((passes, stats))
}

/// Reads the time of each pass by name, from timers that were resolved in a submission.
///
/// # Errors
/// The device was lost.
pub fn read_timers(
    gpu: &Gpu,
    timers: &PassTimers,
) -> Result<Vec<(&'static str, Duration)>, LostGpu> {
    let bytes = read_buffer(gpu, timers.resolved())?;
    let of = |(name, ms): (_, f64)| (name, Duration::from_secs_f64(ms * 1e-3));
    Ok(timers.milliseconds(&bytes).into_iter().map(of).collect())
}

/// The share of the technique's light that is still on its way, at most; None if it does not know ([`Technique::light_to_come`]).
///
/// # Errors
/// The device was lost.
pub fn read_light_to_come(gpu: &Gpu, technique: &dyn Technique) -> Result<Option<f32>, LostGpu> {
    let Some(stat) = technique.light_to_come() else { return Ok(None) };
    let ppm = read_stat(gpu, &stat)?;
    Ok((ppm != u64::from(convergence::UNKNOWN)).then_some(ppm as f32 * 1e-6))
}

/// Reads what probes hold, after all submitted work. `scene`: the fingerprint of the scene that they were made for.
///
/// # Errors
/// The device was lost.
///
/// # Panics
/// If they are those of a file ([`Probes::from_file`]): the file has all of them.
#[cfg(feature = "bake")]
pub fn read_probes(
    gpu: &Gpu,
    probes: &Probes,
    scene: SceneFingerprint,
) -> Result<ProbeBake, LostGpu> {
    assert!(!probes.is_streamed(), "probes of a file are not read back");
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read_buffer(gpu, probes.counts())?[..48]);
    let n = counts.n_voxels as usize;
    let (layout, places) = match (probes.lattice(), probes.occupancy()) {
        (Some(lattice), Some(occupancy)) => {
            let VoxelGrid { origin, cell, size, .. } = *lattice;
            let structure: Vec<[u32; 2]> = words(&read_buffer(gpu, occupancy.structure())?);
            let places = structure[n_bricks(lattice) as usize..][..n].to_vec();
            (BakedLayout::Lattice { origin, cell, size }, places)
        }
        _ => (BakedLayout::Net { points: points_of(probes) }, vec![[0; 2]; n]),
    };
    let gathered: Vec<[[f32; 4]; 9]> = words(&read_buffer(gpu, probes.gathered())?);
    let distances: Vec<[u32; 64]> = words(&read_buffer(gpu, probes.distances())?);
    let probe = |(ix, &[corner, place]): (usize, &[u32; 2])| BakedProbe {
        corner,
        place,
        gathered: gathered[ix],
        distances: distances[ix],
    };
    Ok(ProbeBake {
        scene,
        settings: *probes.settings(),
        n_paths: probes.n_paths(),
        layout,
        probes: places.iter().enumerate().map(probe).collect(),
    })
}

/// The points of the net that probes are at.
#[cfg(all(feature = "bake", feature = "nets"))]
fn points_of(probes: &Probes) -> Vec<glam::Vec3> {
    probes.net().map_or(Vec::new(), |net| net.points().to_vec())
}

/// (There are no nets.)
#[cfg(all(feature = "bake", not(feature = "nets")))]
fn points_of(_probes: &Probes) -> Vec<glam::Vec3> {
    Vec::new()
}

/// A net for probes could not be made.
#[cfg(feature = "nets")]
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlaceNetError {
    /// No net of these points.
    #[error(transparent)]
    Net(#[from] NetError),
    /// The scene could not be voxelized.
    #[error(transparent)]
    Voxels(#[from] VoxelError),
    /// A setting is out of range.
    #[error("{0}")]
    Setting(String),
    /// The device was lost.
    #[error(transparent)]
    Lost(#[from] LostGpu),
}

/// Makes a net for a scene: finds points by its rule, leaves out those that are inside something, and adds fillers.
///
/// # Errors
/// [`PlaceNetError`].
#[cfg(feature = "nets")]
pub fn place_net(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    settings: &NetSettings,
) -> Result<PlacedNet, PlaceNetError> {
    let setting = |what: &str| Err(PlaceNetError::Setting(what.into()));
    if !(0.0..f32::INFINITY).contains(&settings.spacing) {
        return setting("the spacing of a net must be at least 0 m");
    }
    if settings.most == 0 {
        return setting("a net needs room for one probe at least");
    }
    let facts = scene.facts();
    let longest = (facts.bounds_max - facts.bounds_min).max_element();
    let n = if settings.spacing > 0.0 { (longest / settings.spacing).ceil() } else { 16.0 };
    if n > MAX_SIZE as f32 - 4.0 {
        return setting(&format!(
            "voxels of {} m are too many for a scene of {longest} m: use a spacing of {} m at least",
            settings.spacing,
            longest / (MAX_SIZE as f32 - 4.0)
        ));
    }
    // (A margin of 1.5 on both sides.)
    let n = n as u32 + 3;
    let grid =
        grid_for_bounds(facts.bounds_min, facts.bounds_max, Resolution::Longest(n), 1, None)?;
    let points = match &settings.rule {
        NetRule::Points(points) => points.clone(),
        NetRule::Surfaces => voxels_of(gpu, scene, grid)?.beside_surfaces(),
        NetRule::Ground { height } => {
            if !(*height > 0.0 && height.is_finite()) {
                return setting("the height of probes must be above 0 m");
            }
            let above = voxels_of(gpu, scene, grid)?.above_surfaces();
            apart_in_columns(above_floors(gpu, scene, above, *height)?, 0.25 * grid.cell)
        }
    };
    let inspect = InspectPass::new(gpu, scene);
    PlacedNet::of(points, settings, |points| {
        // (Farther than the diagonal of two voxels: what a point outside a room's corner is beside is seen from behind.)
        is_free(gpu, scene, &inspect, points, 4.0 * grid.cell)
    })
}

/// Records, and submits.
#[cfg(feature = "nets")]
fn submitted(
    gpu: &Gpu,
    record: impl FnOnce(&mut Recorder) -> Result<(), VoxelError>,
) -> Result<(), VoxelError> {
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    record(&mut Recorder::new(gpu, &mut encoder))?;
    gpu.queue.submit([encoder.finish()]);
    Ok(())
}

#[cfg(feature = "nets")]
fn voxels_of(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    grid: VoxelGrid,
) -> Result<Candidates, PlaceNetError> {
    let voxelizer = Voxelizer::new(gpu, scene, grid)?;
    submitted(gpu, |recorder| voxelizer.record(recorder, scene, Triangles::All))?;
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read_buffer(gpu, voxelizer.counts())?[..48]);
    if counts.n_overflow > 0 {
        return Err(PlaceNetError::Setting(format!(
            "{} voxels had no room: use a larger spacing",
            counts.n_overflow
        )));
    }
    let structure: Vec<[u32; 2]> = words(&read_buffer(gpu, voxelizer.structure())?);
    Ok(Candidates::of_voxels(grid, &structure, counts.n_voxels))
}

/// Moves points to `height` above what is below them, or half-way to what is above that. Points with nothing below are left out.
#[cfg(feature = "nets")]
fn above_floors(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    points: Vec<glam::Vec3>,
    height: f32,
) -> Result<Vec<glam::Vec3>, PlaceNetError> {
    use glam::Vec3;
    let towards =
        |points: &[Vec3], direction: Vec3, length: f32| -> Result<Vec<f32>, PlaceNetError> {
            let ray = |p: &Vec3| Ray { origin: *p, t_min: 0.0, direction, t_max: length };
            let rays: Vec<Ray> = points.iter().map(ray).collect();
            let hits = nearest_hits(gpu, scene, &rays)?;
            let found = |hit: &Hit| if hit.triangle == NONE { f32::INFINITY } else { hit.t };
            Ok(hits.iter().map(found).collect())
        };
    let down = towards(&points, Vec3::NEG_Y, f32::MAX)?;
    let floors: Vec<Vec3> = points
        .iter()
        .zip(&down)
        .filter(|(_, down)| down.is_finite())
        .map(|(point, down)| *point + Vec3::NEG_Y * *down)
        .collect();
    // (From a little above, so that the floor is not in the way.)
    let start = |floor: &Vec3| *floor + Vec3::Y * (1e-3 * height);
    let up = towards(&floors.iter().map(start).collect::<Vec<_>>(), Vec3::Y, 2.0 * height)?;
    Ok(floors.iter().zip(up).map(|(floor, up)| *floor + Vec3::Y * height.min(0.5 * up)).collect())
}

/// Points of which no two above each other are nearer than `least`: rays from two voxels of a column may have found the same floor.
#[cfg(feature = "nets")]
fn apart_in_columns(points: Vec<glam::Vec3>, least: f32) -> Vec<glam::Vec3> {
    let mut columns: std::collections::HashMap<[u32; 2], Vec<f32>> = Default::default();
    let mut is_new = |point: &glam::Vec3| {
        let heights = columns.entry([point.x.to_bits(), point.z.to_bits()]).or_default();
        let is_new = heights.iter().all(|y| (y - point.y).abs() >= least);
        heights.extend(is_new.then_some(point.y));
        is_new
    };
    points.into_iter().filter(|point| is_new(point)).collect()
}

#[cfg(feature = "nets")]
fn nearest_hits(gpu: &Gpu, scene: &dyn SceneSeam, rays: &[Ray]) -> Result<Vec<Hit>, PlaceNetError> {
    if rays.is_empty() {
        return Ok(Vec::new());
    }
    let copied = wgpu::BufferUsages::COPY_DST;
    let bytes: &[u8] = bytemuck::cast_slice(rays);
    let advice = "use a larger spacing";
    let storage = |what, n| storage_buffer(gpu, what, n, copied, advice).map_err(VoxelError::Gpu);
    let asked = storage("rays", bytes.len() as u64)?;
    gpu.queue.write_buffer(&asked, 0, bytes);
    let answers = storage("hits", (rays.len() * size_of::<Hit>()) as u64)?;
    let kernel = RayKernel::new(gpu, scene, RayQuestion::Nearest);
    let n = rays.len() as u32;
    submitted(gpu, |recorder| Ok(kernel.record(recorder, scene, &asked, &answers, n)?))?;
    Ok(words(&read_buffer(gpu, &answers)?))
}

/// Which of some points are not inside anything, nor behind a wall.
#[cfg(feature = "nets")]
fn is_free(
    gpu: &Gpu,
    scene: &dyn SceneSeam,
    inspect: &InspectPass,
    points: &[glam::Vec3],
    most: f32,
) -> Result<Vec<bool>, PlaceNetError> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    if let Some(ix) = points.iter().position(|point| !point.is_finite()) {
        return Err(NetError::NotFinite(ix).into());
    }
    let copied = wgpu::BufferUsages::COPY_DST;
    let list: Vec<[f32; 4]> = points.iter().map(|p| p.extend(0.0).to_array()).collect();
    let bytes: &[u8] = bytemuck::cast_slice(&list);
    let advice = "use a larger spacing";
    let storage = |what, n| storage_buffer(gpu, what, n, copied, advice).map_err(VoxelError::Gpu);
    let asked = storage("points", bytes.len() as u64)?;
    gpu.queue.write_buffer(&asked, 0, bytes);
    let answers = storage("what is around points", (points.len() * size_of::<Inspected>()) as u64)?;
    let n = points.len() as u32;
    submitted(gpu, |recorder| Ok(inspect.record(recorder, scene, (&asked, &answers), n, most)?))?;
    let found: Vec<Inspected> = words(&read_buffer(gpu, &answers)?);
    Ok(found.iter().map(|of| of.is_inside == 0).collect())
}

/// Whole items of a buffer that may end with a part of one.
#[cfg(any(feature = "bake", feature = "nets"))]
fn words<T: bytemuck::AnyBitPattern>(bytes: &[u8]) -> Vec<T> {
    bytes.chunks_exact(size_of::<T>()).map(bytemuck::pod_read_unaligned).collect()
}

/// Reads the number of a [`Stat`], after all submitted work.
///
/// # Errors
/// The device was lost.
///
/// # Panics
/// If the stat's offset is not within its buffer.
pub fn read_stat(gpu: &Gpu, stat: &Stat) -> Result<u64, LostGpu> {
    match &stat.source {
        StatSource::Known(number) => Ok(*number),
        StatSource::Buffer(buffer, at) => {
            let bytes = read_buffer(gpu, buffer)?;
            let at = *at as usize;
            let word = std::array::from_fn(|ix| bytes[at + ix]);
            Ok(u64::from(u32::from_le_bytes(word)))
        }
    }
}
