//! The kernel `voxel_rt/walls`: notes which faces of each voxel are walled.

use crate::bindings::baseline::kernels::voxel_rt::walls as kernel;
use crate::gpu::Gpu;
use crate::pass::compute_pipeline;
use wgpu::util::DeviceExt;

/// The compiled kernel with its bindings.
#[derive(Debug)]
pub struct WallsPass {
    pipeline: wgpu::ComputePipeline,
    /// `[level][which of the lights is read]`
    bind_groups: Vec<[wgpu::BindGroup; 2]>,
}

/// What a [`WallsPass`] reads and writes.
#[derive(Debug)]
pub struct WallsBuffers<'a> {
    /// `VoxelLevels`, uniform.
    pub levels: &'a wgpu::Buffer,
    /// Each level's count of voxels, uniform, 16 bytes.
    pub counts: &'a [wgpu::Buffer],
    /// Words of all levels.
    pub structure: &'a wgpu::Buffer,
    /// `FaceLight`s of all levels, twice.
    pub lights: &'a [wgpu::Buffer; 2],
    /// One u32: faces that had to leave samples out.
    pub n_rejected: &'a wgpu::Buffer,
}

impl WallsPass {
    /// Compiles the kernel and binds the buffers.
    pub fn new(gpu: &Gpu, buffers: &WallsBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let pipeline = compute_pipeline(gpu, "voxel_rt/walls", "", &[None, Some(&layout)]);
        let bind_groups = buffers
            .counts
            .iter()
            .enumerate()
            .map(|(level, counts)| {
                let info = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                    label: Some("voxel_rt/walls"),
                    contents: bytemuck::bytes_of(&kernel::WallsInfo {
                        level: level as u32,
                        reserved_a: 0,
                        reserved_b: 0,
                        reserved_c: 0,
                    }),
                    usage: wgpu::BufferUsages::UNIFORM,
                });
                [0, 1].map(|read| {
                    let entries =
                        kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                            levels: buffers.levels.as_entire_buffer_binding(),
                            info: info.as_entire_buffer_binding(),
                            counts: counts.as_entire_buffer_binding(),
                            lights: buffers.lights[read].as_entire_buffer_binding(),
                            structure: buffers.structure.as_entire_buffer_binding(),
                            n_rejected: buffers.n_rejected.as_entire_buffer_binding(),
                        });
                    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("voxel_rt/walls"),
                        layout: &layout,
                        entries: &entries.into_array(),
                    })
                })
            })
            .collect();
        Self { pipeline, bind_groups }
    }

    /// Notes the walls of a level from buffer `read`.
    ///
    /// `arguments`: where the workgroup counts for one invocation a slot stand.
    pub fn record(
        &self,
        pass: &mut wgpu::ComputePass,
        level: usize,
        read: usize,
        arguments: (&wgpu::Buffer, u64),
    ) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.bind_groups[level][read], &[]);
        pass.dispatch_workgroups_indirect(arguments.0, arguments.1);
    }
}
