// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sum of a frame's light, and its mean over frames: the kernel `frame/composite`.

use super::{Pixels, check_size};
use crate::bindings::kernels::frame::composite::CompositeInfo;
use crate::bindings::lucerna::camera::primary_ray::Camera;
use crate::film::Film;
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders, radiance_target, target};
use crate::seam::{Mismatch, Revisions, SceneSeam, check_shaders};
use glam::UVec2;

/// Sums over frames, of the same form as the reference's: they give all its channels.
#[derive(Debug)]
pub struct Accumulator {
    film: Film,
    beauty: wgpu::TextureView,
    n_frames: u32,
    /// The camera and the scene of the sums.
    seen: Option<(Camera, Revisions)>,
}

impl Accumulator {
    /// An empty accumulator. `size`: at least 1×1 \[pixels\]; 96 bytes per pixel.
    pub fn new(gpu: &Gpu, size: UVec2) -> Self {
        let film = Film::new(gpu, size);
        let beauty = radiance_target(gpu, "beauty", size);
        Self { film, beauty, n_frames: 0, seen: None }
    }

    /// Starts again with the next frame. (If the camera or the scene has changed, this happens automatically.)
    pub fn reset(&mut self) {
        self.n_frames = 0;
    }

    /// Frames since the last reset.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Sums of all channels, which [`resolve`](crate::film::resolve) turns into pictures.
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
    /// Bound if there is no indirect light.
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

    /// Records one dispatch for each stripe of the accumulator, and counts the frame. The sums start again if the
    /// camera or the scene has changed since the last frame.
    ///
    /// `direct`, `indirect`: rgb radiance \[W·sr⁻¹·m⁻²\], `rgba16float` or `rgba32float`, of the picture's size. If a
    /// frame's light is not finite in a pixel, the frame is left out there and counted.
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for, or sizes differ.
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
