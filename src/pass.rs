//! What every compute pass does alike: compile a kernel, dispatch in two dimensions.

use crate::gpu::Gpu;
use crate::modules::shader_module;

/// A kernel's only entry point as a pipeline. `layouts`: of groups 0 on; None where the kernel asks
/// nothing of the host seam.
pub(crate) fn compute_pipeline(
    gpu: &Gpu,
    name: &'static str,
    variant: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: layouts,
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module: &shader_module(gpu, name, variant),
        entry_point: None,
        compilation_options: Default::default(),
        cache: None,
    })
}

/// A buffer of the device's own, zeroed.
pub(crate) fn buffer(
    gpu: &Gpu,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size.next_multiple_of(4).max(16),
        usage,
        mapped_at_creation: false,
    })
}
