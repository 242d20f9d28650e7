//! The kernel `voxel_rt/publish`: makes of the records what bounces and pictures look up.

use super::cache::{CacheBuffers, LevelPass};
use crate::bindings::baseline::kernels::voxel_rt::publish as kernel;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;

pub use kernel::PublishInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct PublishPass(LevelPass);

impl PublishPass {
    /// Compiles the kernel and binds the buffers.
    pub fn new(gpu: &Gpu, buffers: &CacheBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let label = "voxel_rt/publish";
        let pipeline = compute_pipeline(gpu, label, "", &[None, Some(&layout)]);
        let group = |_, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                structure: buffers.structure.as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
                reflected: buffers.reflected.as_entire_buffer_binding(),
                shown: buffers.shown.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        Self(LevelPass::new::<PublishInfo>(gpu, label, pipeline, &buffers.counts, group))
    }

    /// Publishes level `info.level`.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a record stand.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        info: &PublishInfo,
        arguments: (&wgpu::Buffer, u64),
    ) {
        self.0.record(gpu, pass, info.level, info, arguments);
    }
}
