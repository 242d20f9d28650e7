// SPDX-License-Identifier: MIT OR Apache-2.0
//! `reference`: the unidirectional path tracer that the techniques are measured against.
//!
//! [`PathTracer`] records dispatches into the caller's command encoder; a [`Film`] holds the sums of a picture's pixels
//! between dispatches. The result is the same to the last bit for any number of dispatches.

use crate::bindings::kernels::reference::path_trace::StripeInfo;
use crate::bindings::lucerna::integrators::path::PathSettings;
use crate::frame::camera_for_size;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer};
use crate::scene::Camera;
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::UVec2;

pub use crate::bindings::lucerna::integrators::path::Path;
pub use crate::film::{Channel, Film, LongSums, PixelSums, Stripe, resolve};

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ReferenceSettings {
    /// Width and height \[pixels\].
    pub size: UVec2,
    /// Reflections after the first; 0: direct light only.
    pub n_bounces: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Replaces the first surface with a white Lambertian one, so that [`Channel::Irradiance`] can be resolved.
    pub irradiance: bool,
    /// Radius of [`Channel::Openness`] \[m\]; 0: it is not computed.
    pub occlusion_distance: f32,
}

impl ReferenceSettings {
    /// A picture of this size \[pixels\], with up to 16 reflections after the first.
    pub fn new(size: UVec2) -> Self {
        Self { size, ..Self::default() }
    }
}

impl Default for ReferenceSettings {
    /// A picture of one pixel, with up to 16 reflections after the first.
    fn default() -> Self {
        Self {
            size: UVec2::ONE,
            n_bounces: 16,
            seed: 0,
            irradiance: false,
            occlusion_distance: 0.0,
        }
    }
}

/// One dispatch: some samples of some rows of a stripe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Index into [`Film::stripes`].
    pub stripe: usize,
    /// First row of the picture, within the stripe.
    pub first_row: u32,
    /// Number of rows.
    pub n_rows: u32,
    /// Index of the first sample.
    pub first_sample: u32,
    /// Samples for each pixel.
    pub n_samples: u32,
    /// Continues what the previous dispatch, of the same rows and samples, left unfinished ([`UnfinishedPaths`]).
    pub continues: bool,
}

/// Paths that a dispatch left unfinished, for the next one.
///
/// Mesa's llvmpipe ends loops early once an invocation has run 65 535 loop iterations. The kernel counts them, and
/// stops before that. On such a driver, a dispatch is done when [`PathCounts::n_unfinished`] is 0; until then, record
/// the same [`Work`] again with `continues`. Other drivers finish every dispatch at once.
#[derive(Debug)]
pub struct UnfinishedPaths {
    paths: wgpu::Buffer,
    counts: wgpu::Buffer,
}

/// What a dispatch reports.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[non_exhaustive]
pub struct PathCounts {
    /// Pixels of the last dispatch whose samples are not finished.
    pub n_unfinished: u32,
    /// Samples of all dispatches that were abandoned because a single step of them takes more loop iterations than the
    /// driver runs. They are included in `n_rejected` of [`PixelSums`], and their light is missing.
    pub n_cut: u32,
}

impl UnfinishedPaths {
    /// Room for the paths of a film's largest stripe: 96 bytes a pixel.
    pub fn new(gpu: &Gpu, film: &Film) -> Self {
        let n_rows = film.stripes().iter().map(|stripe| stripe.n_rows).max().unwrap_or(1);
        let n_sums = u64::from(film.size().x) * u64::from(film.n_lanes()) * u64::from(n_rows);
        let bytes = n_sums * size_of::<Path>() as u64;
        let usage = wgpu::BufferUsages::STORAGE;
        let counted = usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        Self {
            paths: buffer(gpu, "unfinished paths", bytes, usage),
            counts: buffer(gpu, "path counts", size_of::<PathCounts>() as u64, counted),
        }
    }

    /// A [`PathCounts`], followed by padding; it has `COPY_SRC`.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct PathTracer {
    kernel: ComputeKernel,
    shaders: Shaders,
}

impl PathTracer {
    /// Compiles the kernel for the scene's variant; it works for every scene of the same variant.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Self {
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        Self {
            kernel: ComputeKernel::new(gpu, shaders, group, "reference/path_trace"),
            shaders: shaders.clone(),
        }
    }

    /// Records one dispatch. Record the samples of a pixel in order, and continue unfinished work ([`UnfinishedPaths`])
    /// before you record other work.
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for, the film has another size than the settings, or
    /// `work` is outside the film.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        film: &Film,
        unfinished: &UnfinishedPaths,
        camera: &Camera,
        settings: &ReferenceSettings,
        work: Work,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        if film.size() != settings.size {
            let (expected, found) = (settings.size, film.size());
            return Err(Mismatch::Size { what: "film", expected, found });
        }
        let is_inside = |stripe: &&Stripe| {
            let last = u64::from(work.first_row) + u64::from(work.n_rows);
            work.first_row >= stripe.first_row
                && last <= u64::from(stripe.first_row) + u64::from(stripe.n_rows)
        };
        let stripe = film.stripes().get(work.stripe).filter(is_inside);
        let stripe = stripe.ok_or(Mismatch::Rows)?;
        let path_settings = PathSettings {
            size: settings.size,
            first_sample: work.first_sample,
            n_samples: work.n_samples,
            n_lanes: film.n_lanes(),
            n_bounces: settings.n_bounces,
            seed: settings.seed,
            irradiance: u32::from(settings.irradiance),
            occlusion_distance: settings.occlusion_distance,
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        let stripe_info = StripeInfo {
            first_stripe_row: stripe.first_row,
            first_row: work.first_row,
            n_rows: work.n_rows,
            continues: u32::from(work.continues),
        };
        let n_unfinished = Some(size_of::<u32>() as u64);
        recorder.encoder().clear_buffer(&unfinished.counts, 0, n_unfinished);
        let n_columns = settings.size.x * film.n_lanes();
        self.kernel
            .call(&mut recorder.compute(self.kernel.name()))
            .scene(scene.group())
            .uniform("camera", &camera_for_size(camera, settings.size))
            .uniform("settings", &path_settings)
            .uniform("stripe", &stripe_info)
            .bind("sums", &stripe.sums)
            .bind("paths", &unfinished.paths)
            .bind("progress", &unfinished.counts)
            .dispatch(Dispatch::Area(UVec2::new(n_columns, work.n_rows)));
        Ok(())
    }
}
