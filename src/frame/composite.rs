//! A frame's light put together, and its mean over frames: the kernel `frame/composite`.

use super::direct::radiance_target;
use super::gbuffer::extent;
use super::{BindGroupCache, Frame, GBuffer};
use crate::bindings::baseline::kernels::frame::composite as kernel;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::compute_pipeline;
use crate::reference::Film;
use glam::UVec2;

/// Sums over frames, of the same kind as the reference's: all its channels can be had from them.
#[derive(Debug)]
pub struct Accumulator {
    film: Film,
    beauty: wgpu::TextureView,
    /// One for each stripe of the film, so that one submission can hold all their dispatches.
    infos: Vec<wgpu::Buffer>,
    n_frames: u32,
}

impl Accumulator {
    /// An empty one. `size`: at least 1×1 \[pixels\]; 96 bytes a pixel.
    pub fn new(gpu: &Gpu, size: UVec2) -> Self {
        let film = Film::new(gpu, size);
        let infos = film
            .stripes()
            .iter()
            .map(|_| {
                gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("composite info"),
                    size: size_of::<kernel::CompositeInfo>() as u64,
                    usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                })
            })
            .collect();
        Self { film, beauty: radiance_target(gpu, "beauty", size), infos, n_frames: 0 }
    }

    /// Begins anew with the next frame: the camera or the scene has changed.
    pub fn reset(&mut self) {
        self.n_frames = 0;
    }

    /// Frames since the last reset.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Sums of all channels; [`resolve`](crate::reference::resolve) makes pictures of them.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// rgb: mean radiance over the frames \[W·sr⁻¹·m⁻²\], `rgba32float`.
    pub fn beauty(&self) -> &wgpu::TextureView {
        &self.beauty
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct CompositePass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    variant: &'static str,
    /// Bound where there is no indirect light.
    black: wgpu::TextureView,
    groups: BindGroupCache,
}

impl CompositePass {
    /// Compiles the kernel in the scene's [variant](GpuScene::variant).
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Self {
        let name = "frame/composite";
        let device = &gpu.device;
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let layouts = [Some(scene.layout()), Some(&layout)];
        let pipeline = compute_pipeline(gpu, name, scene.variant(), &layouts);
        Self {
            pipeline,
            layout,
            variant: scene.variant(),
            black: radiance_target(gpu, "no indirect light", UVec2::ONE),
            groups: Default::default(),
        }
    }

    /// Records one dispatch for each stripe of the accumulator, and counts the frame.
    ///
    /// `direct`, `indirect`: rgb radiance \[W·sr⁻¹·m⁻²\], `rgba16float` or `rgba32float`, of the
    /// picture's size. A frame whose light is not finite in a pixel is left out there and counted.
    ///
    /// # Panics
    /// If sizes differ, or the scene's variant is another than the one that the kernel was compiled
    /// for.
    pub fn record(
        &mut self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        direct: &wgpu::TextureView,
        indirect: Option<&wgpu::TextureView>,
        accumulator: &mut Accumulator,
    ) {
        let size = gbuffer.size();
        assert_eq!(self.variant, frame.scene.variant(), "compiled for another variant");
        assert_eq!(frame.view.size(), size, "view and G-buffer differ in size");
        assert_eq!(accumulator.film.size(), size, "G-buffer and accumulator differ in size");
        for light in [Some(direct), indirect].into_iter().flatten() {
            assert_eq!(extent(size), light.texture().size(), "light of another size");
        }
        let uniform = frame.view.uniform();
        let second = indirect.unwrap_or(&self.black);
        for (stripe, info) in accumulator.film.stripes().iter().zip(&accumulator.infos) {
            let values = kernel::CompositeInfo {
                first_row: stripe.first_row,
                n_rows: stripe.n_rows,
                is_first: u32::from(accumulator.n_frames == 0),
                has_indirect: u32::from(indirect.is_some()),
            };
            frame.gpu.queue.write_buffer(info, 0, bytemuck::bytes_of(&values));
            let buffers = [uniform, info, &stripe.sums];
            let views = [&gbuffer.depth, direct, second];
            let group = self.groups.get(&buffers, &views, || {
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                        info: info.as_entire_buffer_binding(),
                        albedo: &gbuffer.albedo,
                        normals: &gbuffer.normals,
                        emission: &gbuffer.emission,
                        depth: &gbuffer.depth,
                        direct,
                        indirect: second,
                        sums: stripe.sums.as_entire_buffer_binding(),
                        beauty: &accumulator.beauty,
                    });
                frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("frame/composite"),
                    layout: &self.layout,
                    entries: &entries.into_array(),
                })
            });
            let timestamps = frame.timers.as_deref_mut().and_then(|t| t.compute("frame/composite"));
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("frame/composite"),
                timestamp_writes: timestamps,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, frame.scene.bind_group(), &[]);
            pass.set_bind_group(1, &group, &[]);
            let side = kernel::WORKGROUP;
            pass.dispatch_workgroups(size.x.div_ceil(side), stripe.n_rows.div_ceil(side), 1);
        }
        accumulator.n_frames += 1;
    }
}
