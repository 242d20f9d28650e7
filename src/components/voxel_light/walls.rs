// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_light/walls`: marks which faces of each voxel have walls behind them.

use super::cache::CacheBuffers;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu, Shaders};

pub use crate::bindings::kernels::voxel_light::walls::WallsInfo;

/// The compiled kernel.
#[derive(Debug)]
pub struct WallsPass(ComputeKernel);

impl WallsPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ComputeKernel::new(gpu, &Shaders::default(), None, "voxel_light/walls"))
    }

    /// Marks the walls of level `info.level`. `slots`: one invocation per slot.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        buffers: &CacheBuffers,
        info: &WallsInfo,
        slots: Dispatch,
    ) {
        self.0
            .call(pass)
            .uniform("info", info)
            .bind("levels", &buffers.levels)
            .bind("counts", &buffers.counts[info.level as usize])
            .bind("lights", &buffers.lights)
            .bind("structure", &buffers.structure)
            .bind("faults", &buffers.faults)
            .dispatch(slots);
    }
}
