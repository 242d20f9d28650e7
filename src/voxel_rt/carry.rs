//! The kernel `voxel_rt/carry`: brings the cache into a new structure.

use crate::bindings::baseline::kernels::voxel_rt::carry as kernel;
use crate::gpu::Gpu;
use crate::pass::{buffer, compute_pipeline};

pub use kernel::CarryInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct CarryPass {
    pipeline: wgpu::ComputePipeline,
    infos: Vec<wgpu::Buffer>,
    /// `[level][which of the lights is read]`
    bind_groups: Vec<[wgpu::BindGroup; 2]>,
}

/// What a [`CarryPass`] reads and writes.
#[derive(Debug)]
pub struct CarryBuffers<'a> {
    /// `VoxelLevels`, uniform.
    pub levels: &'a wgpu::Buffer,
    /// Each level's count of voxels in the new structure, uniform, 16 bytes.
    pub counts: &'a [wgpu::Buffer],
    /// Words of all levels, new.
    pub structure: &'a wgpu::Buffer,
    /// Words of all levels as they were.
    pub structure_before: &'a wgpu::Buffer,
    /// `FaceLight`s of all levels, twice.
    pub lights: &'a [wgpu::Buffer; 2],
}

impl CarryPass {
    /// Compiles the kernel and binds the buffers.
    pub fn new(gpu: &Gpu, buffers: &CarryBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let pipeline = compute_pipeline(gpu, "voxel_rt/carry", "", &[None, Some(&layout)]);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let infos: Vec<_> = buffers
            .counts
            .iter()
            .map(|_| buffer(gpu, "voxel_rt/carry", size_of::<CarryInfo>() as u64, usage))
            .collect();
        let bind_groups = infos
            .iter()
            .zip(buffers.counts)
            .map(|(info, counts)| {
                [0, 1].map(|read| {
                    let entries =
                        kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                            levels: buffers.levels.as_entire_buffer_binding(),
                            info: info.as_entire_buffer_binding(),
                            counts: counts.as_entire_buffer_binding(),
                            structure: buffers.structure.as_entire_buffer_binding(),
                            structure_before: buffers.structure_before.as_entire_buffer_binding(),
                            before: buffers.lights[read].as_entire_buffer_binding(),
                            after: buffers.lights[1 - read].as_entire_buffer_binding(),
                        });
                    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("voxel_rt/carry"),
                        layout: &layout,
                        entries: &entries.into_array(),
                    })
                })
            })
            .collect();
        Self { pipeline, infos, bind_groups }
    }

    /// Carries level `info.level` from buffer `read` into the other.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a slot stand.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        info: CarryInfo,
        read: usize,
        arguments: (&wgpu::Buffer, u64),
    ) {
        let level = info.level as usize;
        gpu.queue.write_buffer(&self.infos[level], 0, bytemuck::bytes_of(&info));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.bind_groups[level][read], &[]);
        pass.dispatch_workgroups_indirect(arguments.0, arguments.1);
    }
}
