//! `reference`: the unidirectional path tracer that the techniques are measured against.
//!
//! [`PathTracer`] records dispatches into a caller's encoder; a [`Film`] holds the sums of a
//! picture's pixels between them. Cutting the work into more or fewer dispatches changes no bit of
//! the result.

mod camera;
mod film;

use crate::bindings::baseline;
use crate::bindings::baseline::kernels::reference::path_trace as kernel;
use crate::bindings::baseline::lucerna::reference::path::PathSettings;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::{buffer, compute_pipeline};
use crate::scene::Camera;
use glam::UVec2;
use wgpu::util::DeviceExt;

pub use baseline::lucerna::reference::path::{Path, PixelSums};
pub(crate) use camera::for_size as camera_for_size;
pub use film::{Channel, Film, LongSums, Stripe, resolve};

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq)]
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
#[derive(Clone, Debug)]
pub struct PathTracer {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    variant: &'static str,
}

impl PathTracer {
    /// Compiles the kernel in the scene's [variant](GpuScene::variant); it serves every scene of the
    /// same variant.
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let layouts = [Some(scene.layout()), Some(&layout)];
        let pipeline = compute_pipeline(gpu, "reference/path_trace", scene.variant(), &layouts);
        Self { pipeline, layout, variant: scene.variant() }
    }

    /// Records one dispatch. Samples of one pixel must be recorded in order, and work that is not done
    /// ([`UnfinishedPaths`]) must be continued before other work is recorded.
    ///
    /// `timestamps`: where the pass writes its begin and end, if it is to be timed.
    ///
    /// # Panics
    /// If `work` lies outside the film, as a slice would, or the scene's variant is another than the
    /// one that the kernel was compiled for.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        film: &Film,
        unfinished: &UnfinishedPaths,
        camera: &Camera,
        settings: &ReferenceSettings,
        work: Work,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) {
        assert_eq!(self.variant, scene.variant(), "the kernel was compiled for another variant");
        let stripe = &film.stripes()[work.stripe];
        let inside = work.first_row >= stripe.first_row
            && work.first_row + work.n_rows <= stripe.first_row + stripe.n_rows;
        assert!(inside && film.size() == settings.size, "{work:?} lies outside the film");
        let uniform = |label, contents: &[u8]| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage: wgpu::BufferUsages::UNIFORM,
            })
        };
        let camera =
            uniform("camera", bytemuck::bytes_of(&camera::for_size(camera, settings.size)));
        let path_settings = uniform(
            "path settings",
            bytemuck::bytes_of(&PathSettings {
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
            }),
        );
        let stripe_info = uniform(
            "stripe",
            bytemuck::bytes_of(&kernel::StripeInfo {
                first_stripe_row: stripe.first_row,
                first_row: work.first_row,
                n_rows: work.n_rows,
                continues: u32::from(work.continues),
            }),
        );
        let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
            camera: camera.as_entire_buffer_binding(),
            settings: path_settings.as_entire_buffer_binding(),
            stripe: stripe_info.as_entire_buffer_binding(),
            sums: stripe.sums.as_entire_buffer_binding(),
            paths: unfinished.paths.as_entire_buffer_binding(),
            progress: unfinished.counts.as_entire_buffer_binding(),
        });
        encoder.clear_buffer(&unfinished.counts, 0, Some(size_of::<u32>() as u64));
        let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reference/path_trace"),
            layout: &self.layout,
            entries: &entries.into_array(),
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reference/path_trace"),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_bind_group(1, &bind_group, &[]);
        let [width, height, _] = kernel::compute::MAIN_WORKGROUP_SIZE;
        let n_columns = settings.size.x * film.n_lanes();
        pass.dispatch_workgroups(n_columns.div_ceil(width), work.n_rows.div_ceil(height), 1);
    }
}
