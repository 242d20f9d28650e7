//! The kernels `voxel_cone/fill` and `voxel_cone/prefilter`: light of voxels into the pyramid, and its mips.

use super::pyramid::Pyramid;
use super::settings::VoxelConeSettings;
use crate::bindings::baseline::kernels::voxel_cone::{fill, prefilter};
use crate::bindings::baseline::lucerna::cone::pyramid::MAX_MIPS;
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use crate::voxel::VoxelAttributes;
use crate::voxel_rt::CacheBuffers;
use glam::UVec3;
use wgpu::util::DeviceExt;

fn uniform(gpu: &Gpu, label: &'static str, contents: &[u8]) -> wgpu::Buffer {
    let usage = wgpu::BufferUsages::UNIFORM;
    let descriptor = wgpu::util::BufferInitDescriptor { label: Some(label), contents, usage };
    gpu.device.create_buffer_init(&descriptor)
}

/// Groups of 4 × 4 × 4 over a box.
fn dispatch(pass: &mut wgpu::ComputePass, size: UVec3) {
    let groups = (size + fill::SIDE - 1) / fill::SIDE;
    pass.dispatch_workgroups(groups.x, groups.y, groups.z);
}

/// Writes mip 0 of every level.
#[derive(Debug)]
pub(super) struct FillPass {
    pipeline: wgpu::ComputePipeline,
    target: wgpu::BindGroup,
    levels: Vec<(UVec3, wgpu::BindGroup)>,
}

impl FillPass {
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        buffers: &CacheBuffers,
        attributes: &[VoxelAttributes],
        settings: &VoxelConeSettings,
    ) -> Self {
        let layout = fill::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let (target_layout, target) = pyramid.filling(gpu);
        let label = "voxel_cone/fill";
        let layouts = [None, Some(&layout), Some(&target_layout)];
        let pipeline = compute_pipeline(gpu, label, pyramid.variant(), &layouts);
        let levels = (0..)
            .zip(attributes)
            .map(|(level, attributes)| {
                let info = fill::FillInfo {
                    level,
                    fills_gaps: u32::from(settings.fills_gaps),
                    backs_hide: u32::from(settings.opaque_backs),
                    reserved: 0,
                };
                let info = uniform(gpu, label, bytemuck::bytes_of(&info));
                let entries = fill::WgpuBindGroup1Entries::new(fill::WgpuBindGroup1EntriesParams {
                    levels: buffers.levels.as_entire_buffer_binding(),
                    info: info.as_entire_buffer_binding(),
                    structure: buffers.structure.as_entire_buffer_binding(),
                    records: attributes.records().as_entire_buffer_binding(),
                    irradiance: buffers.reflected.as_entire_buffer_binding(),
                    lights: buffers.lights.as_entire_buffer_binding(),
                });
                let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some(label),
                    layout: &layout,
                    entries: &entries.into_array(),
                });
                (pyramid.layout().levels[level as usize].size, group)
            })
            .collect();
        Self { pipeline, target, levels }
    }

    pub fn record(&self, frame: &mut Frame) {
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_cone/fill"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_cone/fill")),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(2, &self.target, &[]);
        for (size, group) in &self.levels {
            pass.set_bind_group(1, group, &[]);
            dispatch(&mut pass, *size);
        }
    }
}

/// Makes the mips of every level from its mip 0.
#[derive(Debug)]
pub struct PrefilterPass {
    pipeline: wgpu::ComputePipeline,
    /// For mips 1, 2 and 3.
    volumes: [wgpu::BindGroup; 3],
    /// Of each mip that is made: itself, its size, its settings.
    mips: Vec<(u32, UVec3, wgpu::BindGroup)>,
}

impl PrefilterPass {
    /// Compiles the kernel and binds the volumes.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        let layout = prefilter::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let made = [1, 2, 3].map(|mip| pyramid.prefiltering(gpu, mip));
        let label = "voxel_cone/prefilter";
        let layouts = [None, Some(&layout), Some(&made[0].0)];
        let pipeline = compute_pipeline(gpu, label, pyramid.variant(), &layouts);
        let of_layout = pyramid.layout();
        let mut mips = Vec::new();
        for level in 0..of_layout.n_levels {
            for mip in 1..of_layout.levels[level as usize].n_mips {
                let info = prefilter::PrefilterInfo { level, mip, reserved_a: 0, reserved_b: 0 };
                let info = uniform(gpu, label, bytemuck::bytes_of(&info));
                let entries =
                    prefilter::WgpuBindGroup1Entries::new(prefilter::WgpuBindGroup1EntriesParams {
                        info: info.as_entire_buffer_binding(),
                    });
                let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some(label),
                    layout: &layout,
                    entries: &entries.into_array(),
                });
                mips.push((mip, of_layout.mips[(level * MAX_MIPS + mip) as usize].size, group));
            }
        }
        Self { pipeline, volumes: made.map(|(_, group)| group), mips }
    }

    /// Records all mips, each from the one below.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_cone/prefilter"),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        for (mip, size, group) in &self.mips {
            // Mips 2, 4, … go from odd to even as 2 does, mips 3, 5, … from even to odd as 3 does.
            let volumes = if *mip == 1 { 0 } else { 1 + (*mip as usize & 1) };
            pass.set_bind_group(1, group, &[]);
            pass.set_bind_group(2, &self.volumes[volumes], &[]);
            dispatch(&mut pass, *size);
        }
    }
}
