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
use crate::pass::compute_pipeline;
use crate::scene::Camera;
use glam::UVec2;
use wgpu::util::DeviceExt;

pub use baseline::lucerna::reference::path::PixelSums;
pub(crate) use camera::for_size as camera_for_size;
pub use film::{Channel, Film, Stripe, resolve};

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

    /// Records one dispatch. Samples of one pixel must be recorded in order.
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
                n_bounces: settings.n_bounces,
                seed: settings.seed,
                irradiance: u32::from(settings.irradiance),
                occlusion_distance: settings.occlusion_distance,
            }),
        );
        let stripe_info = uniform(
            "stripe",
            bytemuck::bytes_of(&kernel::StripeInfo {
                first_stripe_row: stripe.first_row,
                first_row: work.first_row,
                n_rows: work.n_rows,
                reserved: 0,
            }),
        );
        let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
            camera: camera.as_entire_buffer_binding(),
            settings: path_settings.as_entire_buffer_binding(),
            stripe: stripe_info.as_entire_buffer_binding(),
            sums: stripe.sums.as_entire_buffer_binding(),
        });
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
        pass.dispatch_workgroups(settings.size.x.div_ceil(width), work.n_rows.div_ceil(height), 1);
    }
}
