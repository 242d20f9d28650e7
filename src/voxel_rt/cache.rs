//! The cache's buffers, and what every kernel does that runs once a level.

use super::{FaceLight, VoxelRtError};
use crate::bindings::baseline::kernels::voxel_rt::shade as field;
use crate::bindings::baseline::lucerna::voxel::levels::VoxelLevels;
use crate::gpu::Gpu;
use crate::pass::{buffer, storage_buffer};
use bytemuck::Pod;

/// Everything that the technique keeps between frames, of all levels together.
#[derive(Debug)]
pub struct CacheBuffers {
    /// `VoxelLevels`, uniform.
    pub levels: wgpu::Buffer,
    /// Each level's count of voxels, and of those that found no room: uniform, 16 bytes.
    pub counts: Vec<wgpu::Buffer>,
    /// Of each level the bricks' words, then a packed cell and its walls for each slot.
    pub structure: wgpu::Buffer,
    /// `structure` as it was before something moved.
    pub structure_before: wgpu::Buffer,
    /// `array<FaceLight>`: of each level, slot · faces + face.
    pub lights: wgpu::Buffer,
    /// `lights` as they were before something moved.
    pub lights_before: wgpu::Buffer,
    /// What bounces see, `array<vec4<f32>>` in the order of `lights`.
    pub reflected: wgpu::Buffer,
    /// What pictures see, likewise.
    pub shown: wgpu::Buffer,
    /// Two u32, counted over all frames: faces with light that was not finite, and faces of which samples are missing
    /// because the driver ended loops early.
    pub faults: wgpu::Buffer,
}

impl CacheBuffers {
    /// Buffers with room for so many words of structure and records of light.
    ///
    /// # Errors
    /// [`VoxelRtError::Gpu`]: one is larger than the device binds.
    pub fn new(
        gpu: &Gpu,
        layout: &VoxelLevels,
        n_words: u32,
        n_records: u32,
    ) -> Result<Self, VoxelRtError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let uniform = wgpu::BufferUsages::UNIFORM | copied;
        let storage = |what, n: u32, bytes: usize| {
            let advice = "use a lower resolution, fewer levels, or an isotropic grid";
            storage_buffer(gpu, what, u64::from(n) * bytes as u64, copied, advice)
        };
        let levels = buffer(gpu, "voxel levels", size_of::<VoxelLevels>() as u64, uniform);
        gpu.queue.write_buffer(&levels, 0, bytemuck::bytes_of(layout));
        Ok(Self {
            levels,
            counts: (0..layout.n_levels)
                .map(|_| buffer(gpu, "voxel counts", 16, uniform | wgpu::BufferUsages::COPY_SRC))
                .collect(),
            structure: storage("voxel structure", n_words, 8)?,
            structure_before: storage("former voxel structure", n_words, 8)?,
            lights: storage("light of voxels", n_records, size_of::<FaceLight>())?,
            lights_before: storage("former light of voxels", n_records, size_of::<FaceLight>())?,
            reflected: storage("reflected light of voxels", n_records, 16)?,
            shown: storage("shown light of voxels", n_records, 16)?,
            faults: storage("faults of faces", 2, 4)?,
        })
    }

    /// Bind group 2 of kernels that look light up: `reflected` or `shown`.
    pub(super) fn field(
        &self,
        gpu: &Gpu,
        light: &wgpu::Buffer,
    ) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let layout = field::WgpuBindGroup2::get_bind_group_layout(&gpu.device);
        let entries = field::WgpuBindGroup2Entries::new(field::WgpuBindGroup2EntriesParams {
            levels: self.levels.as_entire_buffer_binding(),
            structure: self.structure.as_entire_buffer_binding(),
            face_light: light.as_entire_buffer_binding(),
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel light"),
            layout: &layout,
            entries: &entries.into_array(),
        });
        (layout, group)
    }
}

/// A kernel that runs once a level, each time with settings of its own.
#[derive(Debug)]
pub(crate) struct LevelPass {
    pipeline: wgpu::ComputePipeline,
    infos: Vec<wgpu::Buffer>,
    groups: Vec<wgpu::BindGroup>,
}

impl LevelPass {
    /// `group`: makes bind group 1 of a level, of its index, its settings and its counts.
    pub fn new<I: Pod>(
        gpu: &Gpu,
        label: &'static str,
        pipeline: wgpu::ComputePipeline,
        counts: &[wgpu::Buffer],
        group: impl Fn(usize, &wgpu::Buffer, &wgpu::Buffer) -> wgpu::BindGroup,
    ) -> Self {
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let infos: Vec<_> =
            counts.iter().map(|_| buffer(gpu, label, size_of::<I>() as u64, usage)).collect();
        let groups = (0..counts.len()).map(|ix| group(ix, &infos[ix], &counts[ix])).collect();
        Self { pipeline, infos, groups }
    }

    /// Dispatches the kernel for a level. `arguments`: where the workgroup counts stand.
    pub fn record<I: Pod>(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        level: u32,
        info: &I,
        arguments: (&wgpu::Buffer, u64),
    ) {
        let level = level as usize;
        gpu.queue.write_buffer(&self.infos[level], 0, bytemuck::bytes_of(info));
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.groups[level], &[]);
        pass.dispatch_workgroups_indirect(arguments.0, arguments.1);
    }
}
