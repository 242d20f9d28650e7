//! The kernel `voxel_cone/peak`: by what the light of the pyramid is scaled.

use super::pyramid::Pyramid;
use crate::bindings::baseline::kernels::voxel_cone::peak as kernel;
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::pass::{buffer, compute_pipeline};
use crate::voxel::RECORD_GROUPS_OFFSET;
use crate::voxel_rt::{CacheBuffers, LevelPass, VoxelRt};

/// The compiled kernel with its uniforms, bindings and result.
#[derive(Debug)]
pub(super) struct PeakPass {
    levels: LevelPass,
    peak: wgpu::Buffer,
}

impl PeakPass {
    pub fn new(gpu: &Gpu, buffers: &CacheBuffers) -> Self {
        let label = "voxel_cone/peak";
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let peak = buffer(gpu, label, 4, usage);
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let pipeline = compute_pipeline(gpu, label, "", &[None, Some(&layout)]);
        let of_level = |_: usize, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                irradiance: buffers.reflected.as_entire_buffer_binding(),
                peak: peak.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        let levels =
            LevelPass::new::<kernel::PeakInfo>(gpu, label, pipeline, &buffers.counts, of_level);
        Self { levels, peak }
    }

    /// Records it, ahead of the pyramid's filling.
    pub fn record(&self, frame: &mut Frame, light: &VoxelRt, pyramid: &Pyramid) {
        frame.encoder.clear_buffer(&self.peak, 0, None);
        {
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("voxel_cone/peak"),
                timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_cone/peak")),
            });
            for (level, voxelizer) in (0..).zip(light.voxelizers()) {
                let info = kernel::PeakInfo { level, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
                let arguments = (voxelizer.counts(), RECORD_GROUPS_OFFSET);
                self.levels.record(frame.gpu, &mut pass, level, &info, arguments);
            }
        }
        pyramid.take_peak(frame.encoder, &self.peak);
    }
}
