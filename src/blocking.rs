// SPDX-License-Identifier: MIT OR Apache-2.0
//! Functions that wait for the GPU, for programs and tests. Nothing else in the library waits.

use crate::components::convergence;
#[cfg(feature = "bake")]
use crate::components::probes::{BakedProbe, ProbeBake, Probes};
#[cfg(feature = "bake")]
use crate::components::voxels::{VoxelCounts, n_bricks};
use crate::frame::{DirectSettings, FrameError, FramePasses, View, ViewSettings};
use crate::gpu::{AdapterChoice, Gpu, GpuError, PassTimers, Recorder, check_not_empty};
use crate::scene::Camera;
#[cfg(feature = "bake")]
use crate::scene::SceneFingerprint;
use crate::seam::{Mismatch, SceneSeam};
use crate::techniques::reference::{
    Film, LongSums, PathCounts, PathTracer, PixelSums, ReferenceSettings, UnfinishedPaths, Work,
};
use crate::techniques::{Stat, StatSource, Technique, TechniqueError};
use std::time::{Duration, Instant};

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
#[cfg(feature = "bake")]
pub fn read_probes(
    gpu: &Gpu,
    probes: &Probes,
    scene: SceneFingerprint,
) -> Result<ProbeBake, LostGpu> {
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read_buffer(gpu, probes.occupancy().counts())?[..48]);
    let n = counts.n_voxels as usize;
    let lattice = probes.lattice();
    let first = n_bricks(lattice) as usize;
    let structure: Vec<[u32; 2]> = words(&read_buffer(gpu, probes.occupancy().structure())?);
    let gathered: Vec<[[f32; 4]; 9]> = words(&read_buffer(gpu, probes.gathered())?);
    let distances: Vec<[u32; 64]> = words(&read_buffer(gpu, probes.distances())?);
    let probe = |ix: usize| {
        let [corner, place] = structure[first + ix];
        BakedProbe { corner, place, gathered: gathered[ix], distances: distances[ix] }
    };
    Ok(ProbeBake {
        scene,
        settings: *probes.settings(),
        n_paths: probes.n_paths(),
        origin: lattice.origin,
        cell: lattice.cell,
        size: lattice.size,
        probes: (0..n).map(probe).collect(),
    })
}

/// Whole items of a buffer that may end with a part of one.
#[cfg(feature = "bake")]
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
