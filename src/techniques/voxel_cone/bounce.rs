// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_cone/bounce`: light reflected between voxels.

use super::settings::VoxelConeSettings;
use crate::bindings::kernels::voxel_cone::bounce::BounceInfo;
use crate::components::voxel_light::VoxelLight;
use crate::components::voxel_pyramid::Pyramid;
use crate::components::voxels::{RECORD_GROUPS_OFFSET, VoxelAttributes};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders};
use crate::shader::Variant;

/// The compiled kernel.
#[derive(Debug)]
pub(super) struct BouncePass(ComputeKernel);

impl BouncePass {
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        let shaders = Shaders::new(pyramid.variant(Variant::BASELINE));
        Self(ComputeKernel::new(gpu, &shaders, None, "voxel_cone/bounce"))
    }

    /// Records this frame's share of the faces: one in `period`.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        light: &VoxelLight,
        attributes: &[VoxelAttributes],
        pyramid: &Pyramid,
        settings: &VoxelConeSettings,
        period: u32,
    ) {
        let buffers = light.buffers();
        let pass = &mut recorder.compute(self.0.name());
        for ((level, voxelizer), attributes) in (0..).zip(light.voxelizers()).zip(attributes) {
            let info = BounceInfo {
                cones: settings.stepping.into(),
                n_cones: settings.n_bounce_cones,
                level,
                frame: light.n_frames(),
                period,
            };
            self.0
                .call(pass)
                .uniform("info", &info)
                .with(buffers.of_level(level))
                .bind("records", attributes.records())
                .with(pyramid.field())
                .dispatch(Dispatch::Indirect(voxelizer.counts(), RECORD_GROUPS_OFFSET));
        }
    }
}
