//! Occlusion close by, in the picture's depths: the kernels `voxel_cone/occlusion` and
//! `voxel_cone/occlusion_resolve`.

use super::pyramid::Pyramid;
use super::settings::VoxelConeSettings;
use super::shade::{openness_target, specular_spread};
use crate::bindings::baseline::kernels::voxel_cone::occlusion as kernel;
use crate::bindings::baseline::kernels::voxel_cone::occlusion_resolve as resolve;
use crate::frame::{BindGroupCache, Frame, GBuffer};
use crate::gpu::Gpu;
use crate::pass::{buffer, compute_pipeline, entry_pipeline};
use glam::UVec2;

/// The compiled kernels with their targets.
#[derive(Debug)]
pub(super) struct OcclusionPass {
    /// Shares of the hemisphere, at a quarter of the pixels.
    diffuse: Option<wgpu::ComputePipeline>,
    /// Of the mirror's cone.
    specular: Option<wgpu::ComputePipeline>,
    resolve: wgpu::ComputePipeline,
    info: wgpu::Buffer,
    pyramid: wgpu::Buffer,
    resolve_info: wgpu::Buffer,
    groups: [BindGroupCache; 3],
    targets: Option<(UVec2, [wgpu::TextureView; 3])>,
}

impl OcclusionPass {
    /// None where neither is asked for.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid, settings: &VoxelConeSettings) -> Option<Self> {
        if !settings.occludes_diffuse && !settings.occludes_specular {
            return None;
        }
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let resolve_layout = resolve::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let of_entry = |entry| {
            entry_pipeline(gpu, "voxel_cone/occlusion", "", &[None, Some(&layout)], Some(entry))
        };
        let resolved = [None, Some(&resolve_layout)];
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let info = buffer(gpu, "voxel_cone/occlusion", 16, usage);
        let of_cones = kernel::OcclusionInfo {
            start_cells: settings.stepping.start_cells,
            specular_spread: specular_spread(settings.specular),
            reserved_a: 0,
            reserved_b: 0,
        };
        gpu.queue.write_buffer(&info, 0, bytemuck::bytes_of(&of_cones));
        let resolve_info = buffer(gpu, "voxel_cone/occlusion_resolve", 16, usage);
        let of_resolve = resolve::ResolveInfo {
            has_diffuse: u32::from(settings.occludes_diffuse),
            has_specular: u32::from(settings.occludes_specular),
            reserved_a: 0,
            reserved_b: 0,
        };
        gpu.queue.write_buffer(&resolve_info, 0, bytemuck::bytes_of(&of_resolve));
        Some(Self {
            diffuse: settings.occludes_diffuse.then(|| of_entry(kernel::ENTRY_DIFFUSE)),
            specular: settings.occludes_specular.then(|| of_entry(kernel::ENTRY_SPECULAR)),
            resolve: compute_pipeline(gpu, "voxel_cone/occlusion_resolve", "", &resolved),
            info,
            pyramid: pyramid.uniform().clone(),
            resolve_info,
            groups: Default::default(),
            targets: None,
        })
    }

    /// Records all passes and returns where openness will stand: r of the hemisphere, g of the mirror's cone.
    pub fn record(&mut self, frame: &mut Frame, gbuffer: &GBuffer) -> wgpu::TextureView {
        let gpu = frame.gpu;
        let size = gbuffer.size();
        let [quarter, full, out] = self.targets(gpu, size);
        let uniform = frame.view.uniform();
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout;
        let [of_diffuse, of_specular, of_resolve] = &mut self.groups;
        let passes = [
            (&self.diffuse, of_diffuse, &quarter, "voxel_cone/occlusion_diffuse", 2),
            (&self.specular, of_specular, &full, "voxel_cone/occlusion_specular", 1),
        ];
        for (pipeline, groups, target, label, scale) in passes {
            let Some(pipeline) = pipeline else { continue };
            let group = groups.get(&[uniform], &[&gbuffer.depth, target], || {
                let entries =
                    kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                        view: uniform.as_entire_buffer_binding(),
                        info: self.info.as_entire_buffer_binding(),
                        albedo_texture: &gbuffer.albedo,
                        normal_texture: &gbuffer.normals,
                        emission_texture: &gbuffer.emission,
                        depth_texture: &gbuffer.depth,
                        open: target,
                        pyramid: self.pyramid.as_entire_buffer_binding(),
                    });
                gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some(label),
                    layout: &layout(&gpu.device),
                    entries: &entries.into_array(),
                })
            });
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(label),
                timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute(label)),
            });
            pass.set_pipeline(pipeline);
            pass.set_bind_group(1, &group, &[]);
            let side = kernel::WORKGROUP * scale;
            pass.dispatch_workgroups(size.x.div_ceil(side), size.y.div_ceil(side), 1);
        }
        let label = "voxel_cone/occlusion_resolve";
        let group = of_resolve.get(&[uniform], &[&gbuffer.depth, &out], || {
            let entries =
                resolve::WgpuBindGroup1Entries::new(resolve::WgpuBindGroup1EntriesParams {
                    view: uniform.as_entire_buffer_binding(),
                    info: self.resolve_info.as_entire_buffer_binding(),
                    normal_texture: &gbuffer.normals,
                    depth_texture: &gbuffer.depth,
                    diffuse_open: &quarter,
                    specular_open: &full,
                    occlusion: &out,
                });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &resolve::WgpuBindGroup1::get_bind_group_layout(&gpu.device),
                entries: &entries.into_array(),
            })
        });
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(label),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute(label)),
        });
        pass.set_pipeline(&self.resolve);
        pass.set_bind_group(1, &group, &[]);
        let side = resolve::WORKGROUP;
        pass.dispatch_workgroups(size.x.div_ceil(side), size.y.div_ceil(side), 1);
        out.clone()
    }

    /// A quarter of the pixels, all of them, and the result.
    fn targets(&mut self, gpu: &Gpu, size: UVec2) -> [wgpu::TextureView; 3] {
        match &self.targets {
            Some((of_size, targets)) if *of_size == size => targets.clone(),
            _ => {
                let make = |size| openness_target(gpu, "occlusion", size);
                // A pass that is not there has a texel.
                let of = |pass: &Option<_>, size| if pass.is_some() { size } else { UVec2::ONE };
                let quarter = of(&self.diffuse, (size + 1) / 2);
                let targets = [make(quarter), make(of(&self.specular, size)), make(size)];
                self.targets = Some((size, targets.clone()));
                targets
            }
        }
    }
}
