//! The kernel `voxel_rt/gather`: renews the irradiance of one level's faces.

use super::cache::{CacheBuffers, LevelPass};
use crate::bindings::baseline::kernels::voxel_rt::gather as kernel;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::compute_pipeline;

pub use kernel::GatherInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct GatherPass {
    levels: LevelPass,
    field: wgpu::BindGroup,
    variant: &'static str,
}

impl GatherPass {
    /// Compiles the kernel in the scene's variant and binds the buffers.
    pub fn new(gpu: &Gpu, scene: &GpuScene, buffers: &CacheBuffers) -> Self {
        let device = &gpu.device;
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let (field_layout, field) = buffers.field(gpu, &buffers.reflected);
        let label = "voxel_rt/gather";
        let pipeline = compute_pipeline(
            gpu,
            label,
            scene.variant(),
            &[Some(scene.layout()), Some(&layout), Some(&field_layout)],
        );
        let group = |_, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
            });
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        let levels = LevelPass::new::<GatherInfo>(gpu, label, pipeline, &buffers.counts, group);
        Self { levels, field, variant: scene.variant() }
    }

    /// Renews level `info.level`.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a record stand.
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernel was compiled for.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        scene: &GpuScene,
        info: &GatherInfo,
        arguments: (&wgpu::Buffer, u64),
    ) {
        assert_eq!(self.variant, scene.variant(), "the kernel was compiled for another variant");
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_bind_group(2, &self.field, &[]);
        self.levels.record(gpu, pass, info.level, info, arguments);
    }
}
