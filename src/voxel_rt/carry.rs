//! The kernel `voxel_rt/carry`: brings the cache into a new structure.

use super::cache::{CacheBuffers, LevelPass};
use crate::bindings::baseline::kernels::voxel_rt::carry as kernel;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;

pub use kernel::CarryInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct CarryPass(LevelPass);

impl CarryPass {
    /// Compiles the kernel and binds the buffers.
    pub fn new(gpu: &Gpu, buffers: &CacheBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let label = "voxel_rt/carry";
        let pipeline = compute_pipeline(gpu, label, "", &[None, Some(&layout)]);
        let group = |_, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                structure: buffers.structure.as_entire_buffer_binding(),
                structure_before: buffers.structure_before.as_entire_buffer_binding(),
                before: buffers.lights_before.as_entire_buffer_binding(),
                after: buffers.lights.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        Self(LevelPass::new::<CarryInfo>(gpu, label, pipeline, &buffers.counts, group))
    }

    /// Carries the light of level `info.level`.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a slot stand.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        info: &CarryInfo,
        arguments: (&wgpu::Buffer, u64),
    ) {
        self.0.record(gpu, pass, info.level, info, arguments);
    }
}
