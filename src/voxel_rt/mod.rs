//! `voxel-rt`: rays from lights or the camera deposit irradiance in voxels.
//!
//! [`VoxelIrradiance`] is the memory: accumulators of one [`WriteStrategy`] and the means.
//! [`VoxelInjector`] records the passes that fill it: each [`Injection`] traces rays, writes their
//! samples and adds the records' means to those of the injections before it.

mod inject;
mod structure;
mod write;

pub use crate::bindings::baseline::kernels::voxel_rt::inject::{RUN_SIDE, VoxelSample};
pub use crate::bindings::baseline::lucerna::voxel::grid::VoxelGrid;
pub use inject::{Injection, InjectionSource, VoxelInjector, largest_irradiance};
pub use structure::sparse_grid;
pub use write::{RejectedSamples, VoxelIrradiance, VoxelRtError, WriteStrategy};
