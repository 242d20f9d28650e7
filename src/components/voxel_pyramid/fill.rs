// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels `voxel_pyramid/fill` and `voxel_pyramid/prefilter`, which write the light of voxels into the pyramid and
//! make its mips.

use super::pyramid::Pyramid;
use crate::bindings::kernels::voxel_pyramid::prefilter;
use crate::bindings::lucerna::components::voxel_pyramid::layout::MAX_MIPS;
use crate::components::voxel_light::CacheBuffers;
use crate::components::voxels::VoxelAttributes;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder};

pub use crate::bindings::kernels::voxel_pyramid::fill::FillInfo;

/// Writes mip 0 of every level.
#[derive(Debug)]
pub struct FillPass(ComputeKernel);

impl FillPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        Self(ComputeKernel::new(gpu, &pyramid.shaders(), None, "voxel_pyramid/fill"))
    }

    /// Records the pass. `attributes`: those of the levels. `info`: its `level` is set here.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        pyramid: &Pyramid,
        buffers: &CacheBuffers,
        attributes: &[VoxelAttributes],
        info: FillInfo,
    ) {
        let pass = &mut recorder.compute(self.0.name());
        for (level, attributes) in (0..).zip(attributes) {
            self.0
                .call(pass)
                .uniform("info", &FillInfo { level, ..info })
                .bind("levels", &buffers.levels)
                .bind("structure", &buffers.structure)
                .bind("records", attributes.records())
                .bind("irradiance", &buffers.reflected)
                .bind("lights", &buffers.lights)
                .with(pyramid.filling(0))
                .dispatch(Dispatch::Box(pyramid.layout().levels[level as usize].size));
        }
    }
}

/// Computes the mips of every level from its mip 0.
#[derive(Debug)]
pub struct PrefilterPass(ComputeKernel);

impl PrefilterPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        Self(ComputeKernel::new(gpu, &pyramid.shaders(), None, "voxel_pyramid/prefilter"))
    }

    /// Records all mips, each from the one below.
    pub fn record(&self, recorder: &mut Recorder, pyramid: &Pyramid) {
        let layout = pyramid.layout();
        let pass = &mut recorder.compute(self.0.name());
        for level in 0..layout.n_levels {
            for mip in 1..layout.levels[level as usize].n_mips {
                let info = prefilter::PrefilterInfo { level, mip, reserved_a: 0, reserved_b: 0 };
                self.0
                    .call(pass)
                    .uniform("info", &info)
                    .with(pyramid.filling(mip))
                    .dispatch(Dispatch::Box(layout.mips[(level * MAX_MIPS + mip) as usize].size));
            }
        }
    }
}
