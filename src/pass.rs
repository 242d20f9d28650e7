//! What every pass does alike: compile a kernel, make its buffers, dispatch in two dimensions.

use crate::bindings::baseline::lucerna::math::dispatch::DISPATCH_ROW;
use crate::gpu::{Gpu, GpuError};
use crate::modules::shader_module;

/// A kernel's only entry point as a pipeline; see [`entry_pipeline`].
pub(crate) fn compute_pipeline(
    gpu: &Gpu,
    name: &'static str,
    variant: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
) -> wgpu::ComputePipeline {
    entry_pipeline(gpu, name, variant, layouts, None)
}

/// An entry point of a kernel as a pipeline; None: its only one. `layouts`: of groups 0 on; None where the kernel asks
/// nothing of the host seam.
pub(crate) fn entry_pipeline(
    gpu: &Gpu,
    name: &'static str,
    variant: &'static str,
    layouts: &[Option<&wgpu::BindGroupLayout>],
    entry_point: Option<&str>,
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
        entry_point,
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

/// A storage buffer that can be copied from, zeroed. `usage`: what it is used for besides; `advice`: what
/// to do where the device does not bind as much ([`GpuError::TooLarge`]).
pub(crate) fn storage_buffer(
    gpu: &Gpu,
    what: &'static str,
    bytes: u64,
    usage: wgpu::BufferUsages,
    advice: &'static str,
) -> Result<wgpu::Buffer, GpuError> {
    let limits = gpu.device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if bytes > limit {
        return Err(GpuError::TooLarge { what, bytes, limit, advice });
    }
    let usage = usage | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    Ok(buffer(gpu, what, bytes, usage))
}

/// Dispatches `n` invocations in rows, as `dispatch_of_groups` of `wgsl/math/dispatch.wgsl` does.
pub(crate) fn dispatch(pass: &mut wgpu::ComputePass, n: u32, workgroup: u32) {
    let groups = n.div_ceil(workgroup);
    pass.dispatch_workgroups(groups.min(DISPATCH_ROW), groups.div_ceil(DISPATCH_ROW), 1);
}
