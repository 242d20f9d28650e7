// SPDX-License-Identifier: MIT OR Apache-2.0
//! Masks of what probes see of the cells that surfaces meet: the kernels `probes/facing` and `masks`.

use super::ADVICE;
use crate::bindings::lucerna::components::probes::masks::{
    MASK_BITS, MASK_SUMS, MASK_WORDS, MaskRange,
};
use crate::components::voxels::{Voxelizer, n_bricks};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, GpuError, Recorder, Shaders, storage_buffer};
use crate::seam::SceneSeam;

/// Bytes of the sums of areas of one voxel.
const SUM_BYTES: u64 = 4 * (MASK_BITS * MASK_SUMS) as u64;
/// The most memory for sums at once \[bytes\].
const MOST_SUMS: u64 = 16 << 20;

/// The compiled kernels, and their sums.
#[derive(Debug)]
pub(super) struct Masks {
    facing: ComputeKernel,
    masks: ComputeKernel,
    areas: wgpu::Buffer,
    n_slots: u32,
    buffer: wgpu::Buffer,
}

impl Masks {
    /// For the cells of a voxelizer.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, voxelizer: &Voxelizer) -> Result<Self, GpuError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let grid = voxelizer.grid();
        let n_slots = ((MOST_SUMS / SUM_BYTES) as u32).min(grid.capacity);
        let bytes = 8 * u64::from(n_bricks(grid)) + Self::cell_bytes() * u64::from(grid.capacity);
        Ok(Self {
            facing: ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), "probes/facing"),
            masks: ComputeKernel::new(gpu, &Shaders::default(), None, "probes/masks"),
            areas: storage_buffer(
                gpu,
                "areas in cells",
                SUM_BYTES * u64::from(n_slots),
                copied,
                ADVICE,
            )?,
            n_slots,
            buffer: storage_buffer(gpu, "masks of probes", bytes, copied, ADVICE)?,
        })
    }

    /// Bytes of a cell's masks.
    pub fn cell_bytes() -> u64 {
        4 * u64::from(MASK_WORDS)
    }

    /// Records the masks of the cells that `voxelizer` has found.
    pub fn record(&self, recorder: &mut Recorder, scene: &dyn SceneSeam, voxelizer: &Voxelizer) {
        let grid = voxelizer.grid();
        let of_bricks = 8 * u64::from(n_bricks(grid));
        let (from, to) = (voxelizer.structure(), &self.buffer);
        recorder.encoder().copy_buffer_to_buffer(from, 0, to, 0, of_bricks);
        for first in (0..grid.capacity).step_by(self.n_slots as usize) {
            recorder.encoder().clear_buffer(&self.areas, 0, None);
            let n = self.n_slots.min(grid.capacity - first);
            let range = MaskRange { first, n, reserved_a: 0, reserved_b: 0 };
            let pass = &mut recorder.compute("probes/masks");
            let facing = self.facing.call(pass).uniform("grid", grid).uniform("range", &range);
            let facing = facing.bind("areas", &self.areas);
            voxelizer.dispatch_pieces(facing.bind("structure", voxelizer.structure()), scene);
            self.masks
                .call(pass)
                .uniform("grid", grid)
                .uniform("range", &range)
                .bind("counts", voxelizer.counts())
                .bind("areas", &self.areas)
                .bind("masks", &self.buffer)
                .dispatch(Dispatch::Items(n));
        }
    }

    /// What look-ups read (`fields::probe_store`).
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.buffer
    }
}
