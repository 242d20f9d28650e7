// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels `voxel_cone/bounce` and `voxel_cone/bounce_surfels`: light reflected between voxels.

use super::Seen;
use super::settings::{Tracing, VoxelConeSettings};
use crate::bindings::kernels::voxel_cone::bounce::BounceInfo;
use crate::components::voxel_light::VoxelLight;
use crate::gpu::{ComputeKernel, Gpu, Recorder, Shaders};
use crate::shader::{SURFEL_CONES, VOLUME_BUFFERS, Variant};

/// The compiled kernel.
#[derive(Debug)]
pub(super) struct BouncePass(ComputeKernel);

impl BouncePass {
    /// `shaders`: of the variant that traces cones.
    pub fn new(gpu: &Gpu, shaders: &Shaders, tracing: Tracing) -> Self {
        let (name, choice) = match tracing {
            Tracing::Surfels => ("voxel_cone/bounce_surfels", SURFEL_CONES),
            Tracing::Prefiltered => ("voxel_cone/bounce", VOLUME_BUFFERS),
        };
        // (It uses no scene.)
        let variant = Variant::BASELINE.with_if(shaders.variant().has(choice), choice);
        Self(ComputeKernel::new(gpu, &Shaders::new(variant), None, name))
    }

    /// Records this frame's share of the faces: one in `period`, or in `settled_period` once the light has settled.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        light: &VoxelLight,
        seen: &Seen,
        settings: &VoxelConeSettings,
        period: u32,
        settled_period: u32,
    ) {
        let buffers = light.buffers();
        let pass = &mut recorder.compute(self.0.name());
        for level in 0..light.n_levels() as u32 {
            let info = BounceInfo {
                cones: settings.stepping.into(),
                n_cones: settings.n_bounce_cones,
                level,
                frame: light.n_frames(),
                period,
                settled_period,
                reserved_a: 0,
                reserved_b: 0,
                reserved_c: 0,
            };
            let mut call = self.0.call(pass).uniform("info", &info).with(buffers.of_level(level));
            if let Seen::Prefiltered(of) = seen {
                call = call.bind("records", of.attributes[level as usize].records());
            }
            call.with(seen.field(light)).dispatch(buffers.records(level));
        }
    }
}
