//! The kernel `voxel_rt/shade`: the picture's surfaces look the voxels up.

use super::Lookup;
use crate::bindings::baseline::kernels::voxel_rt::shade as kernel;
use crate::frame::{BindGroupCache, Frame, GBuffer, radiance_target};
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use glam::UVec2;
use wgpu::util::DeviceExt;

/// The compiled kernel with its target.
#[derive(Debug)]
pub struct ShadePass {
    pipeline: wgpu::ComputePipeline,
    picture_layout: wgpu::BindGroupLayout,
    voxel_layout: wgpu::BindGroupLayout,
    info: wgpu::Buffer,
    picture_groups: BindGroupCache,
    voxel_groups: BindGroupCache,
    /// Made for the picture's size.
    target: Option<(UVec2, wgpu::TextureView)>,
}

/// What a [`ShadePass`] reads besides the G-buffer.
#[derive(Debug)]
pub struct ShadeBuffers<'a> {
    /// `VoxelLevels`, uniform.
    pub levels: &'a wgpu::Buffer,
    /// Words of all levels.
    pub structure: &'a wgpu::Buffer,
    /// `FaceLight`s of all levels.
    pub lights: &'a wgpu::Buffer,
}

impl ShadePass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu, lookup: Lookup) -> Self {
        let picture_layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let voxel_layout = kernel::WgpuBindGroup2::get_bind_group_layout(&gpu.device);
        let pipeline = compute_pipeline(
            gpu,
            "voxel_rt/shade",
            "",
            &[None, Some(&picture_layout), Some(&voxel_layout)],
        );
        let lookup = match lookup {
            Lookup::Valid => kernel::LOOKUP_VALID,
            Lookup::Trilinear => kernel::LOOKUP_TRILINEAR,
            Lookup::SevenTap => kernel::LOOKUP_SEVEN_TAP,
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
        Self {
            pipeline,
            picture_layout,
            voxel_layout,
            info,
            picture_groups: BindGroupCache::default(),
            voxel_groups: BindGroupCache::default(),
            target: None,
        }
    }

    /// Records the look-ups of a picture and returns where they will stand: indirect radiance,
    /// `rgba32float`.
    pub fn record(
        &mut self,
        frame: &mut Frame,
        gbuffer: &GBuffer,
        buffers: &ShadeBuffers,
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
        let uniform = frame.view.uniform();
        let picture = self.picture_groups.get(
            &[uniform],
            &[&gbuffer.albedo, &gbuffer.normals, &gbuffer.emission, &gbuffer.depth],
            || {
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                        albedo_texture: &gbuffer.albedo,
                        normal_texture: &gbuffer.normals,
                        emission_texture: &gbuffer.emission,
                        depth_texture: &gbuffer.depth,
                    });
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel_rt/shade"),
                    layout: &self.picture_layout,
                    entries: &entries.into_array(),
                })
            },
        );
        let voxels = self.voxel_groups.get(&[buffers.lights], &[&target], || {
            let entries = kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: self.info.as_entire_buffer_binding(),
                structure: buffers.structure.as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
                indirect: &target,
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("voxel_rt/shade"),
                layout: &self.voxel_layout,
                entries: &entries.into_array(),
            })
        });
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/shade"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/shade")),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &picture, &[]);
        pass.set_bind_group(2, &voxels, &[]);
        let [width, height, _] = kernel::compute::MAIN_WORKGROUP_SIZE;
        pass.dispatch_workgroups(size.x.div_ceil(width), size.y.div_ceil(height), 1);
        target
    }
}
