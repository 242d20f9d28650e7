//! The kernel `voxel_rt/gather`: renews the irradiance of one level's faces.

use crate::bindings::baseline::kernels::voxel_rt::gather as kernel;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::{buffer, compute_pipeline};

pub use kernel::GatherInfo;

/// The compiled kernel with its uniforms and, for each direction of the ping-pong, its bindings.
#[derive(Debug)]
pub struct GatherPass {
    pipeline: wgpu::ComputePipeline,
    infos: Vec<wgpu::Buffer>,
    /// `[level][which buffer is read]`
    bind_groups: Vec<[wgpu::BindGroup; 2]>,
    variant: &'static str,
}

/// What a [`GatherPass`] reads and writes.
#[derive(Debug)]
pub struct GatherBuffers<'a> {
    /// `VoxelLevels`, uniform.
    pub levels: &'a wgpu::Buffer,
    /// Each level's count of voxels, uniform, 16 bytes.
    pub counts: &'a [wgpu::Buffer],
    /// Words of all levels.
    pub structure: &'a wgpu::Buffer,
    /// `FaceLight`s of all levels, twice.
    pub lights: &'a [wgpu::Buffer; 2],
}

impl GatherPass {
    /// Compiles the kernel in the scene's variant and binds the buffers.
    pub fn new(gpu: &Gpu, scene: &GpuScene, buffers: &GatherBuffers) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let pipeline = compute_pipeline(
            gpu,
            "voxel_rt/gather",
            scene.variant(),
            &[Some(scene.layout()), Some(&layout)],
        );
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let infos: Vec<_> = buffers
            .counts
            .iter()
            .map(|_| buffer(gpu, "voxel_rt/gather", size_of::<GatherInfo>() as u64, usage))
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
                            before: buffers.lights[read].as_entire_buffer_binding(),
                            after: buffers.lights[1 - read].as_entire_buffer_binding(),
                        });
                    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                        label: Some("voxel_rt/gather"),
                        layout: &layout,
                        entries: &entries.into_array(),
                    })
                })
            })
            .collect();
        Self { pipeline, infos, bind_groups, variant: scene.variant() }
    }

    /// Renews level `info.level`, reading buffer `read` and writing the other.
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
        info: GatherInfo,
        read: usize,
        arguments: (&wgpu::Buffer, u64),
    ) {
        assert_eq!(self.variant, scene.variant(), "the kernel was compiled for another variant");
        let level = info.level as usize;
        gpu.queue.write_buffer(&self.infos[level], 0, bytemuck::bytes_of(&info));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_bind_group(1, &self.bind_groups[level][read], &[]);
        pass.dispatch_workgroups_indirect(arguments.0, arguments.1);
    }
}
