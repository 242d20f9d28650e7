// SPDX-License-Identifier: MIT OR Apache-2.0
//! Attributes of the voxels' surfaces: the kernels `voxels/accumulate` and `voxels/resolve`.

use super::ADVICE;
use super::grid::{MAX_BINDING, RECORD_BYTES, VoxelError};
use super::voxelize::{Triangles, Voxelizer};
use crate::bindings::lucerna::components::voxels::attributes::{N_SUMS, SlotRange};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, storage_buffer};
use crate::seam::SceneSeam;

/// Records of the faces of a [`Voxelizer`]'s voxels.
///
/// | buffer | bytes |
/// |---|---|
/// | [`records`](Self::records) | 16 · n_faces · capacity |
/// | sums | 88 · n_faces · capacity, at most 128 MiB: then the voxels take turns in ranges of slots |
#[derive(Debug)]
pub struct VoxelAttributes {
    accumulate: ComputeKernel,
    resolve: ComputeKernel,
    /// Number of slots that `sums` has room for.
    n_slots: u32,
    sums: wgpu::Buffer,
    records: wgpu::Buffer,
}

impl VoxelAttributes {
    /// Compiles the kernels and creates the buffers for the voxelizer's grid.
    ///
    /// # Errors
    /// A buffer is larger than the device can bind ([`VoxelError::Gpu`]).
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        voxelizer: &Voxelizer,
    ) -> Result<Self, VoxelError> {
        Self::with_scratch(gpu, scene, voxelizer, MAX_BINDING)
    }

    /// As [`VoxelAttributes::new`], with at most `scratch` bytes for the sums (but enough for one voxel): less memory,
    /// and more ranges of slots that take turns.
    ///
    /// # Errors
    /// As [`VoxelAttributes::new`].
    pub fn with_scratch(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        voxelizer: &Voxelizer,
        scratch: u64,
    ) -> Result<Self, VoxelError> {
        let grid = voxelizer.grid();
        let none = wgpu::BufferUsages::empty();
        let voxel_bytes = u64::from(N_SUMS) * 8 * u64::from(grid.n_faces);
        let scratch = scratch.min(gpu.device.limits().max_storage_buffer_binding_size);
        let n_slots = (scratch / voxel_bytes).clamp(1, u64::from(grid.capacity)) as u32;
        let sum_bytes = u64::from(n_slots) * voxel_bytes;
        let record_bytes = RECORD_BYTES * u64::from(grid.n_faces) * u64::from(grid.capacity);
        let kernel = |name| ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name);
        Ok(Self {
            accumulate: kernel("voxels/accumulate"),
            resolve: kernel("voxels/resolve"),
            n_slots,
            sums: storage_buffer(gpu, "voxel sums", sum_bytes, none, ADVICE)?,
            records: storage_buffer(gpu, "voxel records", record_bytes, none, ADVICE)?,
        })
    }

    /// Records the computation of all voxels' records from all triangles. `voxelizer`: the one of
    /// [`VoxelAttributes::new`], which must have been recorded before.
    ///
    /// # Errors
    /// [`VoxelError::Mismatch`]; in that case nothing is recorded.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        voxelizer: &Voxelizer,
    ) -> Result<(), VoxelError> {
        voxelizer.work.check(scene)?;
        let grid = voxelizer.grid();
        let pass = &mut recorder.compute("voxels/attributes");
        voxelizer.work.record(pass, scene, grid, Triangles::All);
        for first in (0..grid.capacity).step_by(self.n_slots as usize) {
            let range = SlotRange {
                first,
                n: self.n_slots.min(grid.capacity - first),
                brightest: scene.facts().brightest_emission,
                reserved: 0,
            };
            let accumulate = self.accumulate.call(pass).uniform("grid", grid);
            let accumulate = accumulate.uniform("range", &range).bind("sums", &self.sums);
            let accumulate = accumulate.bind("structure", voxelizer.structure());
            voxelizer.work.dispatch(accumulate, scene);
            self.resolve
                .call(pass)
                .uniform("grid", grid)
                .uniform("range", &range)
                .bind("counts", voxelizer.counts())
                .bind("sums", &self.sums)
                .bind("records", &self.records)
                .dispatch(Dispatch::Items(range.n));
        }
        Ok(())
    }

    /// A record of 16 bytes for each face of each voxel, at slot · n_faces + face; layout in
    /// `wgsl/components/voxels/attributes.wgsl`. Those past [`VoxelCounts::n_records`](super::VoxelCounts) are
    /// not defined.
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records
    }
}
