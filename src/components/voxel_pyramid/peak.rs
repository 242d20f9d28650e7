// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_pyramid/peak`: finds the scale of the pyramid's light.

use super::pyramid::Pyramid;
use crate::bindings::kernels::voxel_pyramid::peak::PeakInfo;
use crate::components::voxel_light::VoxelLight;
use crate::components::voxels::RECORD_GROUPS_OFFSET;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer};

/// The compiled kernel and its result.
#[derive(Debug)]
pub struct PeakPass {
    kernel: ComputeKernel,
    peak: wgpu::Buffer,
}

impl PeakPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        Self {
            kernel: ComputeKernel::new(gpu, &Shaders::default(), None, "voxel_pyramid/peak"),
            peak: buffer(gpu, "voxel_pyramid/peak", 4, usage),
        }
    }

    /// Records the pass, before the pyramid is filled.
    pub fn record(&self, recorder: &mut Recorder, light: &VoxelLight, pyramid: &Pyramid) {
        recorder.encoder().clear_buffer(&self.peak, 0, None);
        {
            let pass = &mut recorder.compute(self.kernel.name());
            for (level, voxelizer) in (0..).zip(light.voxelizers()) {
                let info = PeakInfo { level, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
                self.kernel
                    .call(pass)
                    .uniform("info", &info)
                    .with(light.buffers().of_level(level))
                    .bind("irradiance", &light.buffers().reflected)
                    .bind("peak", &self.peak)
                    .dispatch(Dispatch::Indirect(voxelizer.counts(), RECORD_GROUPS_OFFSET));
            }
        }
        pyramid.take_peak(recorder.encoder(), &self.peak);
    }
}
