// SPDX-License-Identifier: MIT OR Apache-2.0
//! A frame's light put together, and its mean over frames: the kernel `frame/composite`.

use super::{Pixels, check_size};
use crate::bindings::kernels::frame::composite::CompositeInfo;
use crate::bindings::lucerna::camera::primary_ray::Camera;
use crate::film::Film;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders, radiance_target, target};
use crate::seam::{Mismatch, Revisions, SceneSeam, check_shaders};
use glam::UVec2;

/// Sums over frames, of the same kind as the reference's: all its channels can be had from them.
#[derive(Debug)]
pub struct Accumulator {
    film: Film,
    beauty: wgpu::TextureView,
    n_frames: u32,
    /// Of what the sums are: camera and scene.
    seen: Option<(Camera, Revisions)>,
}

impl Accumulator {
    /// An empty one. `size`: at least 1×1 \[pixels\]; 96 bytes a pixel.
    pub fn new(gpu: &Gpu, size: UVec2) -> Self {
        let film = Film::new(gpu, size);
        let beauty = radiance_target(gpu, "beauty", size);
        Self { film, beauty, n_frames: 0, seen: None }
    }

    /// Begins anew with the next frame. (Where the camera or the scene has changed, it does so by itself.)
    pub fn reset(&mut self) {
        self.n_frames = 0;
    }

    /// Frames since the last reset.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Sums of all channels; [`resolve`](crate::film::resolve) makes pictures of them.
    pub fn film(&self) -> &Film {
        &self.film
    }

    /// rgb: mean radiance over the frames \[W·sr⁻¹·m⁻²\], `rgba32float`.
    pub fn beauty(&self) -> &wgpu::TextureView {
        &self.beauty
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct CompositePass {
    kernel: ComputeKernel,
    shaders: Shaders,
    /// Bound where there is no indirect light.
    black: wgpu::TextureView,
}

impl CompositePass {
    /// Compiles the kernel for the scene's variant.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Self {
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        let format = wgpu::TextureFormat::Rgba32Float;
        Self {
            kernel: ComputeKernel::new(gpu, shaders, group, "frame/composite"),
            shaders: shaders.clone(),
            black: target(gpu, "no indirect light", UVec2::ONE, format),
        }
    }

    /// Records one dispatch for each stripe of the accumulator, and counts the frame. The sums begin anew where the
    /// camera or the scene has changed since the last one.
    ///
    /// `direct`, `indirect`: rgb radiance \[W·sr⁻¹·m⁻²\], `rgba16float` or `rgba32float`, of the
    /// picture's size. A frame whose light is not finite in a pixel is left out there and counted.
    ///
    /// # Errors
    /// The scene is not what the kernel was compiled for, or sizes differ.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        pixels: &Pixels,
        direct: &wgpu::TextureView,
        indirect: Option<&wgpu::TextureView>,
        accumulator: &mut Accumulator,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        let size = pixels.size();
        check_size("accumulator", size, accumulator.film.size())?;
        pixels.check_target("direct light", direct)?;
        if let Some(indirect) = indirect {
            pixels.check_target("indirect light", indirect)?;
        }
        let now = (pixels.view.data().camera, scene.revisions());
        if accumulator.seen.replace(now) != Some(now) {
            accumulator.n_frames = 0;
        }
        let pass = &mut recorder.compute(self.kernel.name());
        for stripe in accumulator.film.stripes() {
            let info = CompositeInfo {
                first_row: stripe.first_row,
                n_rows: stripe.n_rows,
                is_first: u32::from(accumulator.n_frames == 0),
                has_indirect: u32::from(indirect.is_some()),
            };
            self.kernel
                .call(pass)
                .scene(scene.group())
                .uniform("info", &info)
                .bind("direct", direct)
                .bind("indirect", indirect.unwrap_or(&self.black))
                .bind("sums", &stripe.sums)
                .bind("beauty", &accumulator.beauty)
                .with(pixels.bindings())
                .dispatch(Dispatch::Area(UVec2::new(size.x, stripe.n_rows)));
        }
        accumulator.n_frames += 1;
        Ok(())
    }
}
