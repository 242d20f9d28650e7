//! The kernel `voxel_rt/shade`: the picture's surfaces look the voxels up.

use super::{CacheBuffers, Lookup};
use crate::bindings::baseline::kernels::voxel_rt::shade as kernel;
use crate::bindings::baseline::lucerna::fields::voxel_light;
use crate::frame::{BindGroupCache, Frame, GBuffer, radiance_target};
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use glam::UVec2;
use wgpu::util::DeviceExt;

/// The compiled kernel with its target.
#[derive(Debug)]
pub struct ShadePass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    info: wgpu::Buffer,
    groups: BindGroupCache,
    field: wgpu::BindGroup,
    /// Made for the picture's size.
    target: Option<(UVec2, wgpu::TextureView)>,
}

impl ShadePass {
    /// Compiles the kernel and binds the cache.
    pub fn new(gpu: &Gpu, buffers: &CacheBuffers, lookup: Lookup) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let (field_layout, field) = buffers.field(gpu, &buffers.shown);
        let pipeline = compute_pipeline(
            gpu,
            "voxel_rt/shade",
            "",
            &[None, Some(&layout), Some(&field_layout)],
        );
        let lookup = match lookup {
            Lookup::Valid => voxel_light::LOOKUP_VALID,
            Lookup::Trilinear => voxel_light::LOOKUP_TRILINEAR,
            Lookup::SevenTap => voxel_light::LOOKUP_SEVEN_TAP,
        };
        let info = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("voxel_rt/shade"),
            contents: bytemuck::bytes_of(&kernel::ShadeInfo {
                lookup,
                reserved_a: 0,
                reserved_b: 0,
                reserved_c: 0,
            }),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        Self { pipeline, layout, info, groups: BindGroupCache::default(), field, target: None }
    }

    /// Records the look-ups of a picture and returns where they will stand: indirect radiance,
    /// `rgba32float`.
    pub fn record(&mut self, frame: &mut Frame, gbuffer: &GBuffer) -> wgpu::TextureView {
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
        let uniform = frame.view.uniform();
        let group = self.groups.get(
            &[uniform],
            &[&gbuffer.albedo, &gbuffer.normals, &gbuffer.emission, &gbuffer.depth, &target],
            || {
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                        albedo_texture: &gbuffer.albedo,
                        normal_texture: &gbuffer.normals,
                        emission_texture: &gbuffer.emission,
                        depth_texture: &gbuffer.depth,
                        info: self.info.as_entire_buffer_binding(),
                        indirect: &target,
                    });
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel_rt/shade"),
                    layout: &self.layout,
                    entries: &entries.into_array(),
                })
            },
        );
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/shade"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/shade")),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &group, &[]);
        pass.set_bind_group(2, &self.field, &[]);
        let [width, height, _] = kernel::compute::MAIN_WORKGROUP_SIZE;
        pass.dispatch_workgroups(size.x.div_ceil(width), size.y.div_ceil(height), 1);
        target
    }
}
