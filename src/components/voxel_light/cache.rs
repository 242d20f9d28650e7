// SPDX-License-Identifier: MIT OR Apache-2.0
//! The cache's buffers.

use super::FaceLight;
use crate::bindings::lucerna::components::voxels::levels::VoxelLevels;
use crate::components::voxels::{RECORD_GROUPS_OFFSET, VoxelCounts};
use crate::gpu::{Bindings, Dispatch, Gpu, GpuError, buffer, storage_buffer};

/// Everything that the technique keeps between frames, for all levels together.
#[derive(Debug)]
pub struct CacheBuffers {
    /// `VoxelLevels`, uniform.
    pub levels: wgpu::Buffer,
    /// For each level one [`VoxelCounts`], in which second records count as well: uniform (of which the first 16 bytes are bound), storage
    /// and indirect.
    pub counts: Vec<wgpu::Buffer>,
    /// For each level the bricks' words, then for each slot a packed cell and 0, then for each record
    /// its side (`wgsl/components/voxel_light/sides.wgsl`).
    pub structure: wgpu::Buffer,
    /// `structure` before something moved.
    pub structure_before: wgpu::Buffer,
    /// `array<FaceLight>`: for each level, indexed by slot · faces + face.
    pub lights: wgpu::Buffer,
    /// `lights` before something moved.
    pub lights_before: wgpu::Buffer,
    /// What bounces look up, `array<vec4<f32>>` in the order of `lights`.
    pub reflected: wgpu::Buffer,
    /// What pictures look up, in the same form.
    pub shown: wgpu::Buffer,
    /// Two u32, counted over all frames: faces whose light was not finite, and faces with missing samples because the
    /// driver ended loops early.
    pub faults: wgpu::Buffer,
}

impl CacheBuffers {
    /// Creates buffers with room for this many words of structure and records of light.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`]: a buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        layout: &VoxelLevels,
        n_words: u32,
        n_records: u32,
    ) -> Result<Self, GpuError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let uniform = wgpu::BufferUsages::UNIFORM | copied;
        let storage = |what, n: u32, bytes: usize| {
            let advice = "use a lower resolution, fewer levels, or an isotropic grid";
            storage_buffer(gpu, what, u64::from(n) * bytes as u64, copied, advice)
        };
        let counted = uniform
            | wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::INDIRECT
            | wgpu::BufferUsages::COPY_SRC;
        let levels = buffer(gpu, "voxel levels", size_of::<VoxelLevels>() as u64, uniform);
        gpu.queue.write_buffer(&levels, 0, bytemuck::bytes_of(layout));
        Ok(Self {
            levels,
            counts: (0..layout.n_levels)
                .map(|_| buffer(gpu, "voxel counts", size_of::<VoxelCounts>() as u64, counted))
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

    /// What a kernel that works on one level binds.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn of_level(&self, level: u32) -> Bindings<'_> {
        vec![
            ("levels", (&self.levels).into()),
            ("counts", (&self.counts[level as usize]).into()),
            ("tally", (&self.counts[level as usize]).into()),
            ("structure", (&self.structure).into()),
            ("structure_before", (&self.structure_before).into()),
            ("lights", (&self.lights).into()),
            ("lights_before", (&self.lights_before).into()),
            ("reflected", (&self.reflected).into()),
            ("shown", (&self.shown).into()),
            ("faults", (&self.faults).into()),
        ]
    }

    /// One invocation per record of a level, second ones included.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn records(&self, level: u32) -> Dispatch<'_> {
        Dispatch::Indirect(&self.counts[level as usize], RECORD_GROUPS_OFFSET)
    }

    /// The bindings of kernels that look up light (`fields::voxel_light`): `reflected` or `shown`.
    pub fn field<'a>(&'a self, light: &'a wgpu::Buffer) -> Bindings<'a> {
        vec![
            ("levels", (&self.levels).into()),
            ("structure", (&self.structure).into()),
            ("face_light", light.into()),
        ]
    }
}
