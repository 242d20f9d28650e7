// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfels: a plane piece for the surface that each face of a voxel sees, so that rays through voxels meet surfaces where they
//! are (`wgsl/components/voxel_surfels/surfel.wgsl`).
//!
//! ```text
//! VoxelLight (structure, sides) ──▶ Surfels ─────────────▶ fields::voxel_surfels
//!            └── irradiance of faces ──────────────────────────▲
//! ```

use crate::bindings::kernels::voxel_surfels::find::FindInfo;
use crate::components::voxel_light::{CacheBuffers, VoxelLight};
use crate::gpu::{Bindings, ComputeKernel, Gpu, GpuError, Recorder, storage_buffer};
use crate::seam::SceneSeam;

/// The surfels of all records of a [`VoxelLight`] that knows sides ([`VoxelLightSettings::divides`](crate::components::voxel_light::VoxelLightSettings::divides)), and the kernel
/// `voxel_surfels/find`.
#[derive(Debug)]
pub struct Surfels {
    find: ComputeKernel,
    surfels: wgpu::Buffer,
}

impl Surfels {
    /// Compiles the kernel for the scene's variant, and creates the buffer: 16 bytes a record.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`]: the buffer is larger than the device can bind.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, light: &VoxelLight) -> Result<Self, GpuError> {
        let none = wgpu::BufferUsages::empty();
        let advice = "use a lower resolution, or fewer levels";
        let bytes = light.buffers().reflected.size();
        Ok(Self {
            find: ComputeKernel::new(
                gpu,
                scene.shaders(),
                Some(scene.group()),
                "voxel_surfels/find",
            ),
            surfels: storage_buffer(gpu, "surfels", bytes, none, advice)?,
        })
    }

    /// Finds the surfels of the levels that the light's last update gave a new structure.
    pub fn record(&self, recorder: &mut Recorder, scene: &dyn SceneSeam, light: &VoxelLight) {
        let pass = &mut recorder.compute(self.find.name());
        let buffers = light.buffers();
        for level in (0..light.n_levels() as u32).filter(|&level| light.is_new(level as usize)) {
            let info = FindInfo { level, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
            self.find
                .call(pass)
                .scene(scene.group())
                .uniform("info", &info)
                .with(buffers.of_level(level))
                .bind("found", &self.surfels)
                .dispatch(buffers.records(level));
        }
    }

    /// The surfels, `array<vec4<u32>>` in the order of [`CacheBuffers::lights`].
    pub fn buffer(&self) -> &wgpu::Buffer {
        &self.surfels
    }

    /// The bindings of kernels that follow rays from surfel to surfel (`fields::voxel_surfels`), which reflect what `buffers` have
    /// for bounces.
    pub fn field<'a>(&'a self, buffers: &'a CacheBuffers) -> Bindings<'a> {
        let mut bindings = buffers.field(&buffers.reflected);
        bindings.push(("surfels", (&self.surfels).into()));
        bindings
    }
}
