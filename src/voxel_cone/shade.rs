//! The kernel `voxel_cone/shade`: cones from the picture's surfaces.

use super::pyramid::Pyramid;
use super::settings::{Specular, VoxelConeSettings};
use crate::bindings::baseline::kernels::voxel_cone::shade as kernel;
use crate::frame::{BindGroupCache, Frame, GBuffer, radiance_target};
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use glam::UVec2;
use wgpu::util::DeviceExt;

/// tan of half the mirror cone's aperture; 0: from the roughness.
pub(super) fn specular_spread(specular: Specular) -> f32 {
    match specular {
        Specular::Fixed(degrees) => (0.5 * degrees).to_radians().tan(),
        Specular::Off | Specular::Roughness => 0.0,
    }
}

/// A texture for shares of what is open: `rgba8unorm`.
pub(super) fn openness_target(gpu: &Gpu, label: &str, size: UVec2) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// The compiled kernel with its target.
#[derive(Debug)]
pub(super) struct ShadePass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    info: wgpu::Buffer,
    groups: BindGroupCache,
    pyramid: wgpu::BindGroup,
    /// Made for the picture's size.
    target: Option<(UVec2, wgpu::TextureView)>,
    /// Bound where there is no occlusion.
    nothing: wgpu::TextureView,
}

impl ShadePass {
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, settings: &VoxelConeSettings, occluded: bool) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let (pyramid_layout, group) = pyramid.reading(gpu);
        let label = "voxel_cone/shade";
        let layouts = [None, Some(&layout), Some(&pyramid_layout)];
        let pipeline = compute_pipeline(gpu, label, pyramid.variant(), &layouts);
        let info = kernel::ShadeInfo {
            cones: settings.stepping.into(),
            n_cones: settings.n_cones,
            has_specular: u32::from(settings.specular != Specular::Off),
            specular_spread: specular_spread(settings.specular),
            has_occlusion: u32::from(occluded),
        };
        let info = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytemuck::bytes_of(&info),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        Self {
            pipeline,
            layout,
            info,
            groups: BindGroupCache::default(),
            pyramid: group,
            target: None,
            nothing: openness_target(gpu, "no occlusion", UVec2::ONE),
        }
    }

    /// Records the cones of a picture and returns where the light will stand: `rgba32float`, a: ambient
    /// occlusion.
    pub fn record(
        &mut self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        occlusion: Option<&wgpu::TextureView>,
    ) -> wgpu::TextureView {
        let gpu = frame.gpu;
        let size = gbuffer.size();
        let target = match &self.target {
            Some((of_size, view)) if *of_size == size => view.clone(),
            _ => {
                let view = radiance_target(gpu, "indirect light", size);
                self.target = Some((size, view.clone()));
                view
            }
        };
        let occlusion = occlusion.unwrap_or(&self.nothing);
        let uniform = frame.view.uniform();
        let group = self.groups.get(
            &[uniform],
            &[
                &gbuffer.albedo,
                &gbuffer.normals,
                &gbuffer.emission,
                &gbuffer.depth,
                occlusion,
                &target,
            ],
            || {
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                        albedo_texture: &gbuffer.albedo,
                        normal_texture: &gbuffer.normals,
                        emission_texture: &gbuffer.emission,
                        depth_texture: &gbuffer.depth,
                        info: self.info.as_entire_buffer_binding(),
                        occlusion,
                        indirect: &target,
                    });
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel_cone/shade"),
                    layout: &self.layout,
                    entries: &entries.into_array(),
                })
            },
        );
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_cone/shade"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_cone/shade")),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &group, &[]);
        pass.set_bind_group(2, &self.pyramid, &[]);
        let [width, height, _] = kernel::compute::MAIN_WORKGROUP_SIZE;
        pass.dispatch_workgroups(size.x.div_ceil(width), size.y.div_ceil(height), 1);
        target
    }
}
