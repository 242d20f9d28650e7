// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_light/carry`: copies the cache into a new structure.

use super::cache::CacheBuffers;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu, Shaders};

pub use crate::bindings::kernels::voxel_light::carry::CarryInfo;

/// The compiled kernel.
#[derive(Debug)]
pub struct CarryPass(ComputeKernel);

impl CarryPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ComputeKernel::new(gpu, &Shaders::default(), None, "voxel_light/carry"))
    }

    /// Carries the light of level `info.level` over. `slots`: one invocation per slot.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        buffers: &CacheBuffers,
        info: &CarryInfo,
        slots: Dispatch,
    ) {
        self.0
            .call(pass)
            .uniform("info", info)
            .bind("levels", &buffers.levels)
            .bind("counts", &buffers.counts[info.level as usize])
            .bind("structure", &buffers.structure)
            .bind("structure_before", &buffers.structure_before)
            .bind("before", &buffers.lights_before)
            .bind("after", &buffers.lights)
            .dispatch(slots);
    }
}
