//! The kernel `voxel_cone/bounce`: light reflected between voxels.

use super::pyramid::Pyramid;
use super::settings::VoxelConeSettings;
use crate::bindings::baseline::kernels::voxel_cone::bounce as kernel;
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use crate::voxel::{RECORD_GROUPS_OFFSET, VoxelAttributes};
use crate::voxel_rt::{CacheBuffers, LevelPass, VoxelRt};

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub(super) struct BouncePass {
    levels: LevelPass,
    pyramid: wgpu::BindGroup,
}

impl BouncePass {
    pub fn new(
        gpu: &Gpu,
        pyramid: &Pyramid,
        buffers: &CacheBuffers,
        attributes: &[VoxelAttributes],
    ) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let (pyramid_layout, group) = pyramid.reading(gpu);
        let label = "voxel_cone/bounce";
        let layouts = [None, Some(&layout), Some(&pyramid_layout)];
        let pipeline = compute_pipeline(gpu, label, pyramid.variant(), &layouts);
        let of_level = |level: usize, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                structure: buffers.structure.as_entire_buffer_binding(),
                records: attributes[level].records().as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
                faults: buffers.faults.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        let levels =
            LevelPass::new::<kernel::BounceInfo>(gpu, label, pipeline, &buffers.counts, of_level);
        Self { levels, pyramid: group }
    }

    /// Records the turn of this frame: of one face in `period`.
    pub fn record(
        &self,
        frame: &mut Frame,
        light: &VoxelRt,
        settings: &VoxelConeSettings,
        period: u32,
    ) {
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_cone/bounce"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_cone/bounce")),
        });
        pass.set_bind_group(2, &self.pyramid, &[]);
        for (level, voxelizer) in (0..).zip(light.voxelizers()) {
            let info = kernel::BounceInfo {
                cones: settings.stepping.into(),
                n_cones: settings.n_bounce_cones,
                level,
                frame: light.n_frames(),
                period,
            };
            let arguments = (voxelizer.counts(), RECORD_GROUPS_OFFSET);
            self.levels.record(frame.gpu, &mut pass, level, &info, arguments);
        }
    }
}
