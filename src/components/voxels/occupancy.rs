// SPDX-License-Identifier: MIT OR Apache-2.0
//! From bits to a structure: the kernels `voxels/count_bricks` and `write_structure`.

use super::ADVICE;
use super::grid::{VoxelGrid, n_bricks};
use super::scan::{Scan, ScanPlan};
use super::voxelize::VoxelCounts;
use crate::gpu::{
    ComputeKernel, ComputeRecorder, Dispatch, Gpu, GpuError, Shaders, storage_buffer,
};

/// Which places of a grid are occupied, with a slot for each (`wgsl/components/voxels/bricks.wgsl`).
///
/// | buffer | bytes |
/// |---|---|
/// | [`structure`](Self::structure) | 8 · (n_bricks + capacity) |
/// | [`counts`](Self::counts) | 48 |
/// | slots before each brick | 4 · n_bricks |
#[derive(Debug)]
pub struct Occupancy {
    count_bricks: ComputeKernel,
    write_structure: ComputeKernel,
    scan: Scan,
    plan: ScanPlan,
    before: wgpu::Buffer,
    structure: wgpu::Buffer,
    counts: wgpu::Buffer,
}

impl Occupancy {
    /// Compiles the kernels and creates the buffers, for this size and capacity.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`]: a buffer is larger than the device can bind.
    pub fn new(gpu: &Gpu, grid: &VoxelGrid) -> Result<Self, GpuError> {
        let none = wgpu::BufferUsages::empty();
        let n = u64::from(n_bricks(grid));
        let before = storage_buffer(gpu, "voxels before each brick", (n + 1) * 4, none, ADVICE)?;
        let structure_bytes = 8 * (n + u64::from(grid.capacity));
        let count_bytes = size_of::<VoxelCounts>() as u64;
        let copied = wgpu::BufferUsages::COPY_DST;
        let counted = copied | wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::UNIFORM;
        let scan = Scan::new(gpu);
        let plan = scan.plan(gpu, &before, n_bricks(grid) + 1)?;
        let kernel = |name| ComputeKernel::new(gpu, &Shaders::default(), None, name);
        Ok(Self {
            count_bricks: kernel("voxels/count_bricks"),
            write_structure: kernel("voxels/write_structure"),
            scan,
            plan,
            before,
            structure: storage_buffer(gpu, "voxel structure", structure_bytes, copied, ADVICE)?,
            counts: storage_buffer(gpu, "voxel counts", count_bytes, counted, ADVICE)?,
        })
    }

    /// Records the structure of what two sets of bits hold together, a word for each brick.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        grid: &VoxelGrid,
        bits_static: &wgpu::Buffer,
        bits_moving: &wgpu::Buffer,
    ) {
        let n = Dispatch::Items(n_bricks(grid) + 1);
        self.count_bricks
            .call(pass)
            .uniform("grid", grid)
            .bind("bits_static", bits_static)
            .bind("bits_moving", bits_moving)
            .bind("n_voxels", &self.before)
            .dispatch(n);
        self.scan.record(pass, &self.plan);
        self.write_structure
            .call(pass)
            .uniform("grid", grid)
            .bind("bits_static", bits_static)
            .bind("bits_moving", bits_moving)
            .bind("n_before", &self.before)
            .bind("structure", &self.structure)
            .bind("counts", &self.counts)
            .dispatch(n);
    }

    /// Uploads a structure that is known: its words, with `n_voxels` of them after those of the bricks.
    #[cfg(feature = "bake")]
    pub(crate) fn upload(&self, gpu: &Gpu, grid: &VoxelGrid, words: &[[u32; 2]], n_voxels: u32) {
        gpu.queue.write_buffer(&self.structure, 0, bytemuck::cast_slice(words));
        let counts = VoxelCounts::known(n_voxels, grid.n_faces);
        gpu.queue.write_buffer(&self.counts, 0, bytemuck::bytes_of(&counts));
    }

    /// `array<vec2<u32>>`: for each brick its occupied bits and first slot, then `capacity` entries
    /// (packed cell, 0), of which the first `n_voxels` are valid. See `wgsl/components/voxels/bricks.wgsl`.
    pub fn structure(&self) -> &wgpu::Buffer {
        &self.structure
    }

    /// One [`VoxelCounts`], also for indirect dispatches: see [`VOXEL_GROUPS_OFFSET`](super::VOXEL_GROUPS_OFFSET) and
    /// [`RECORD_GROUPS_OFFSET`](super::RECORD_GROUPS_OFFSET).
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }
}
