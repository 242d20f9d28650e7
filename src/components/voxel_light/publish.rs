// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_light/publish`: computes from the records what bounces and pictures look up.

use super::cache::CacheBuffers;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu, Shaders};

pub use crate::bindings::kernels::voxel_light::publish::PublishInfo;

/// The compiled kernel.
#[derive(Debug)]
pub struct PublishPass(ComputeKernel);

impl PublishPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ComputeKernel::new(gpu, &Shaders::default(), None, "voxel_light/publish"))
    }

    /// Publishes level `info.level`. `records`: one invocation per record.
    pub fn record(
        &self,
        pass: &mut ComputeRecorder,
        buffers: &CacheBuffers,
        info: &PublishInfo,
        records: Dispatch,
    ) {
        self.0
            .call(pass)
            .uniform("info", info)
            .bind("levels", &buffers.levels)
            .bind("counts", &buffers.counts[info.level as usize])
            .bind("structure", &buffers.structure)
            .bind("lights", &buffers.lights)
            .bind("reflected", &buffers.reflected)
            .bind("shown", &buffers.shown)
            .dispatch(records);
    }
}
