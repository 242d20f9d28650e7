// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light of every pixel: the kernel `frame/direct`.

use super::Pixels;
use crate::bindings::lucerna::integrators::direct_light::DirectSettings as Uniform;
use crate::components::LightVisibility;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders, buffer, radiance_target};
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::UVec2;

/// Numbers of samples of direct light. (If there are at most 16 point, spot and directional lights, each gets a ray of
/// its own.)
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DirectSettings {
    /// Samples of emissive triangles and the sky, per pixel and frame.
    pub n_samples: u32,
    /// Samples of the BSDF, per pixel and frame, which hit lights by chance: they reduce the noise of bright, near
    /// lights and of reflections in glossy surfaces. 0: none; the mean is the same, with more noise.
    pub n_bsdf_samples: u32,
}

impl Default for DirectSettings {
    fn default() -> Self {
        Self { n_samples: 4, n_bsdf_samples: 1 }
    }
}

impl DirectSettings {
    /// Numbers of light samples and of BSDF samples, per pixel and frame.
    pub fn new(n_samples: u32, n_bsdf_samples: u32) -> Self {
        Self { n_samples, n_bsdf_samples }
    }
}

/// The compiled kernel with its target.
#[derive(Debug)]
pub struct DirectPass {
    kernel: ComputeKernel,
    shaders: Shaders,
    settings: DirectSettings,
    visibility: LightVisibility,
    faults: wgpu::Buffer,
    radiance: wgpu::TextureView,
}

impl DirectPass {
    /// Compiles the kernel for the scene's variant and creates a target of this size \[pixels\].
    ///
    /// `visibility`: how pixels find out which lights they see. (Cones only serve light samples: with `n_bsdf_samples`
    /// of 0 they determine all direct light.)
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        size: UVec2,
        settings: DirectSettings,
        visibility: &LightVisibility,
    ) -> Self {
        let variant = visibility.variant(scene.shaders().variant());
        let shaders = scene.shaders().with_variant(variant);
        Self {
            kernel: ComputeKernel::new(gpu, &shaders, Some(scene.group()), "frame/direct"),
            shaders: scene.shaders().clone(),
            settings,
            visibility: visibility.clone(),
            faults: buffer(
                gpu,
                "faults of direct light",
                8,
                wgpu::BufferUsages::STORAGE
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
            ),
            radiance: radiance_target(gpu, "direct", size),
        }
    }

    /// rgb: reflected radiance \[W·sr⁻¹·m⁻²\], 0 where there is no surface; a: 1 on surfaces.
    /// `rgba32float`.
    pub fn radiance(&self) -> &wgpu::TextureView {
        &self.radiance
    }

    /// Two u32 that count pixels of all frames so far: those whose light was not finite and was replaced by 0, and
    /// those whose light is wrong because the driver ended loops early (too many light samples for it). The buffer has
    /// `COPY_SRC`.
    pub fn faults(&self) -> &wgpu::Buffer {
        &self.faults
    }

    /// Records one dispatch.
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for, or sizes differ.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        pixels: &Pixels,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        let size = pixels.size();
        pixels.check_target("direct light", &self.radiance)?;
        let settings = Uniform {
            n_light_samples: self.settings.n_samples,
            n_bsdf_samples: self.settings.n_bsdf_samples,
            reserved_a: 0,
            reserved_b: 0,
        };
        self.kernel
            .call(&mut recorder.compute(self.kernel.name()))
            .scene(scene.group())
            .uniform("settings", &settings)
            .bind("direct", &self.radiance)
            .bind("faults", &self.faults)
            .with(self.visibility.bindings())
            .with(pixels.bindings())
            .dispatch(Dispatch::Area(size));
        Ok(())
    }
}
