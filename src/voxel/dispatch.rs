//! Kernels of the voxelizer on the host: pipelines without the host seam, and long dispatches.

use crate::bindings::baseline::lucerna::math::dispatch::DISPATCH_ROW;
use crate::gpu::Gpu;
use crate::modules::shader_module;

/// `dispatch_of_groups` of `wgsl/math/dispatch.wgsl`.
pub(super) fn dispatch(pass: &mut wgpu::ComputePass, n: u32, workgroup: u32) {
    let groups = n.div_ceil(workgroup);
    pass.dispatch_workgroups(groups.min(DISPATCH_ROW), groups.div_ceil(DISPATCH_ROW), 1);
}

/// A kernel's pipeline; `seam`: the layout of group 0, where it asks the host seam.
pub(super) fn pipeline(
    gpu: &Gpu,
    name: &'static str,
    variant: &'static str,
    seam: Option<&wgpu::BindGroupLayout>,
    own: &wgpu::BindGroupLayout,
) -> wgpu::ComputePipeline {
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &[seam, Some(own)],
        immediate_size: 0,
    });
    gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module: &shader_module(gpu, name, variant),
        entry_point: Some("main"),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// A storage buffer, zeroed.
pub(super) fn buffer(
    gpu: &Gpu,
    what: &'static str,
    bytes: u64,
    usage: wgpu::BufferUsages,
) -> Result<wgpu::Buffer, crate::gpu::GpuError> {
    let limit = gpu.device.limits().max_storage_buffer_binding_size;
    if bytes > limit {
        let advice = "use fewer cells, a smaller capacity, or a smaller scene";
        return Err(crate::gpu::GpuError::TooLarge { what, bytes, limit, advice });
    }
    Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(what),
        size: bytes.max(16),
        usage: usage | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    }))
}
