// SPDX-License-Identifier: MIT OR Apache-2.0
//! `reference`: the unidirectional path tracer that the techniques are measured against.
//!
//! [`PathTracer`] records dispatches into a caller's encoder; a [`Film`] holds the sums of a
//! picture's pixels between them. Cutting the work into more or fewer dispatches changes no bit of
//! the result.

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
    /// Stream of random numbers.
    pub seed: u32,
    /// The first surface is a white Lambertian, so that [`Channel::Irradiance`] can be resolved.
    pub irradiance: bool,
    /// How far [`Channel::Openness`] looks \[m\]; 0: it is not asked for.
    pub occlusion_distance: f32,
}

impl ReferenceSettings {
    /// A picture of this size \[pixels\], with up to 16 reflections after the first.
    pub fn new(size: UVec2) -> Self {
        Self { size, ..Self::default() }
    }
}

impl Default for ReferenceSettings {
    /// A pixel, with up to 16 reflections after the first.
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
    /// Rows.
    pub n_rows: u32,
    /// Index of the first sample.
    pub first_sample: u32,
    /// Samples for each pixel.
    pub n_samples: u32,
    /// Takes up what the dispatch before, of the same rows and samples, has left undone ([`UnfinishedPaths`]).
    pub continues: bool,
}

/// Paths that a dispatch has left under way, for the next one.
///
/// Mesa's llvmpipe ends loops early once an invocation has taken 65 535 iterations of them. The kernel notices, and stops
/// before. A dispatch on such a driver is done when [`PathCounts::n_unfinished`] is 0; until then record the same [`Work`]
/// again with `continues`. Other drivers finish every dispatch at once.
#[derive(Debug)]
pub struct UnfinishedPaths {
    paths: wgpu::Buffer,
    counts: wgpu::Buffer,
}

/// What a dispatch reports.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct PathCounts {
    /// Pixels of the last dispatch that have not reached the end of their samples.
    pub n_unfinished: u32,
    /// Samples of all dispatches that were given up, for a single step of theirs takes more loops than the driver runs.
    /// They count among [`PixelSums`]'s `n_rejected`, and their light is missing.
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

    /// A [`PathCounts`], then padding; it has `COPY_SRC`.
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
    /// Compiles the kernel for the scene's variant; it serves every scene of the same variant.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Self {
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        Self {
            kernel: ComputeKernel::new(gpu, shaders, group, "reference/path_trace"),
            shaders: shaders.clone(),
        }
    }

    /// Records one dispatch. Samples of one pixel must be recorded in order, and work that is not done
    /// ([`UnfinishedPaths`]) must be continued before other work is recorded.
    ///
    /// # Errors
    /// The scene is not what the kernel was compiled for.
    ///
    /// # Panics
    /// If `work` lies outside the film, as a slice would.
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
        let stripe = &film.stripes()[work.stripe];
        let inside = work.first_row >= stripe.first_row
            && work.first_row + work.n_rows <= stripe.first_row + stripe.n_rows;
        assert!(inside && film.size() == settings.size, "{work:?} lies outside the film");
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
