// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernel `voxel_cone/shade`: cones from the picture's surfaces.

use super::settings::{Specular, VoxelConeSettings};
use crate::bindings::kernels::voxel_cone::shade as kernel;
use crate::frame::Pixels;
use crate::gpu::{Bindings, ComputeKernel, Dispatch, Gpu, Recorder, SceneGroup, Shaders, target};
use glam::UVec2;

/// tan of half the specular cone's aperture; 0: it follows from the roughness.
pub(super) fn specular_spread(specular: Specular) -> f32 {
    match specular {
        Specular::Fixed(degrees) => (0.5 * degrees).to_radians().tan(),
        Specular::Off | Specular::Roughness => 0.0,
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub(super) struct ShadePass {
    kernel: ComputeKernel,
    /// Bound if there is no occlusion.
    nothing: wgpu::TextureView,
}

impl ShadePass {
    /// `shaders`: of the variant that traces cones, with the module that finds the pixels' surfaces; `scene`: needed if that
    /// module uses the scene.
    pub fn new(gpu: &Gpu, shaders: &Shaders, scene: Option<&SceneGroup>) -> Self {
        let format = wgpu::TextureFormat::Rgba8Unorm;
        Self {
            kernel: ComputeKernel::new(gpu, shaders, scene, "voxel_cone/shade"),
            nothing: target(gpu, "no occlusion", UVec2::ONE, format),
        }
    }

    /// Records the cones of a picture into `light`, `rgba32float`. a: ambient occlusion. `field`: what cones see.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        field: Bindings,
        settings: &VoxelConeSettings,
        pixels: &Pixels,
        occlusion: Option<&wgpu::TextureView>,
        light: &wgpu::TextureView,
    ) {
        let info = kernel::ShadeInfo {
            cones: settings.stepping.into(),
            n_cones: settings.n_cones,
            has_specular: u32::from(settings.specular != Specular::Off),
            specular_spread: specular_spread(settings.specular),
            has_occlusion: u32::from(occlusion.is_some()),
        };
        self.kernel
            .call(&mut recorder.compute(self.kernel.name()))
            .uniform("info", &info)
            .bind("occlusion", occlusion.unwrap_or(&self.nothing))
            .bind("indirect", light)
            .with(field)
            .with(pixels.bindings())
            .scene(pixels.scene())
            .dispatch(Dispatch::Area(pixels.size()));
    }
}
