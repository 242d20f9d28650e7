//! The kernel `voxel_rt/walls`: notes which faces of each voxel are walled.

use super::cache::{CacheBuffers, LevelPass};
use crate::bindings::baseline::kernels::voxel_rt::walls as kernel;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;

pub use kernel::WallsInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct WallsPass(LevelPass);

impl WallsPass {
    /// Compiles the kernel and binds the buffers.
    pub fn new(gpu: &Gpu, buffers: &CacheBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let label = "voxel_rt/walls";
        let pipeline = compute_pipeline(gpu, label, "", &[None, Some(&layout)]);
        let group = |_, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
                structure: buffers.structure.as_entire_buffer_binding(),
                faults: buffers.faults.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        Self(LevelPass::new::<WallsInfo>(gpu, label, pipeline, &buffers.counts, group))
    }

    /// Notes the walls of level `info.level`.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a slot stand.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        info: &WallsInfo,
        arguments: (&wgpu::Buffer, u64),
    ) {
        self.0.record(gpu, pass, info.level, info, arguments);
    }
}
