//! Direct light of every pixel: the kernel `frame/direct`.

use super::gbuffer::extent;
use super::{BindGroupCache, Frame, GBuffer};
use crate::bindings::baseline::kernels::frame::direct as kernel;
use crate::bindings::baseline::lucerna::frame::direct_light::DirectSettings as Uniform;
use crate::gpu::Gpu;
use crate::gpu_scene::{GpuScene, RaySource};
use crate::pass::compute_pipeline;
use crate::shadow::{ShadowBinding, ShadowError};
use glam::UVec2;
use wgpu::util::DeviceExt;

const NAME: &str = "frame/direct";

/// How much is spent on direct light. (Point, spot and directional lights get a ray each, as long as
/// there are no more than 16.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectSettings {
    /// Draws of an emissive triangle or the sky, per pixel and frame.
    pub n_samples: u32,
    /// Draws of a reflection, per pixel and frame, which find lights by chance: what is bright and
    /// near, and what glossy surfaces mirror. 0: none; the mean is the same, with more noise.
    pub n_bsdf_samples: u32,
}

impl Default for DirectSettings {
    fn default() -> Self {
        Self { n_samples: 4, n_bsdf_samples: 1 }
    }
}

/// The compiled kernel with its target.
#[derive(Debug)]
pub struct DirectPass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    variant: &'static str,
    settings: wgpu::Buffer,
    faults: wgpu::Buffer,
    radiance: wgpu::TextureView,
    groups: BindGroupCache,
    /// Bind group 2, where shadows are not rays.
    shadows: Option<wgpu::BindGroup>,
}

impl DirectPass {
    /// Compiles the kernel in the scene's [variant](GpuScene::variant) and makes a target of this
    /// size \[pixels\].
    pub fn new(gpu: &Gpu, scene: &GpuScene, size: UVec2, settings: DirectSettings) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let layouts = [Some(scene.layout()), Some(&layout)];
        let pipeline = compute_pipeline(gpu, NAME, scene.variant(), &layouts);
        Self::of_pipeline(gpu, scene, size, settings, pipeline, None)
    }

    /// As [`Self::new`], with shadows by maps or by cones in the place of rays. (Cones stand for the share of the light
    /// that each draw is: `n_bsdf_samples` of 0 leaves all of it to them.)
    ///
    /// # Errors
    /// [`ShadowError::RayQuery`].
    pub fn with_shadows(
        gpu: &Gpu,
        scene: &GpuScene,
        size: UVec2,
        settings: DirectSettings,
        shadows: &ShadowBinding,
    ) -> Result<Self, ShadowError> {
        if scene.rays() == RaySource::RayQuery {
            return Err(ShadowError::RayQuery);
        }
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let layouts = [Some(scene.layout()), Some(&layout), Some(&shadows.layout)];
        let pipeline = compute_pipeline(gpu, NAME, shadows.variant, &layouts);
        let group = Some(shadows.group.clone());
        Ok(Self::of_pipeline(gpu, scene, size, settings, pipeline, group))
    }

    fn of_pipeline(
        gpu: &Gpu,
        scene: &GpuScene,
        size: UVec2,
        settings: DirectSettings,
        pipeline: wgpu::ComputePipeline,
        shadows: Option<wgpu::BindGroup>,
    ) -> Self {
        let device = &gpu.device;
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let settings = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("direct settings"),
            contents: bytemuck::bytes_of(&Uniform {
                n_light_samples: settings.n_samples,
                n_bsdf_samples: settings.n_bsdf_samples,
                reserved_a: 0,
                reserved_b: 0,
            }),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let faults = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("faults of direct light"),
            size: 8,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self {
            pipeline,
            layout,
            variant: scene.variant(),
            settings,
            faults,
            radiance: radiance_target(gpu, "direct", size),
            groups: Default::default(),
            shadows,
        }
    }

    /// rgb: reflected radiance \[W·sr⁻¹·m⁻²\], 0 where there is no surface; a: 1 on surfaces.
    /// `rgba32float`.
    pub fn radiance(&self) -> &wgpu::TextureView {
        &self.radiance
    }

    /// Two u32 that count pixels of all frames so far: those whose light was not finite and was replaced by 0, and those whose
    /// light is wrong because the driver ended loops early (too many light samples for it). It has `COPY_SRC`.
    pub fn faults(&self) -> &wgpu::Buffer {
        &self.faults
    }

    /// Records one dispatch.
    ///
    /// # Panics
    /// If view, G-buffer and target differ in size, or the scene's variant is another than the one
    /// that the kernel was compiled for.
    pub fn record(&mut self, frame: &mut Frame, gbuffer: &GBuffer) {
        let size = gbuffer.size();
        assert_eq!(self.variant, frame.scene.variant(), "compiled for another variant");
        assert_eq!(frame.view.size(), size, "view and G-buffer differ in size");
        assert_eq!(extent(size), self.radiance.texture().size(), "G-buffer and target differ");
        let uniform = frame.view.uniform();
        let group = self.groups.get(&[uniform], &[&gbuffer.depth], || {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                view: uniform.as_entire_buffer_binding(),
                settings: self.settings.as_entire_buffer_binding(),
                albedo: &gbuffer.albedo,
                normals: &gbuffer.normals,
                emission: &gbuffer.emission,
                depth: &gbuffer.depth,
                direct: &self.radiance,
                faults: self.faults.as_entire_buffer_binding(),
            });
            frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame/direct"),
                layout: &self.layout,
                entries: &entries.into_array(),
            })
        });
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("frame/direct"),
            timestamp_writes: frame.timers.as_deref_mut().and_then(|t| t.compute("frame/direct")),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, frame.scene.bind_group(), &[]);
        pass.set_bind_group(1, &group, &[]);
        if let Some(shadows) = &self.shadows {
            pass.set_bind_group(2, shadows, &[]);
        }
        let side = kernel::WORKGROUP;
        pass.dispatch_workgroups(size.x.div_ceil(side), size.y.div_ceil(side), 1);
    }
}

/// A texture for radiance that kernels write and read: `rgba32float`.
pub(crate) fn radiance_target(gpu: &Gpu, label: &str, size: UVec2) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
