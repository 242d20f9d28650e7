//! The frame that all real-time techniques share: G-buffer, direct light, a technique's indirect
//! light, and their sum over frames.
//!
//! ```text
//! View::advance      camera, jitter, matrices          -> uniform buffer
//! ShadowMaps         what lights see, where asked for  -> depth maps
//! GBufferPass        rasterises the scene              -> GBuffer
//! Technique::update  what the technique keeps up to date
//! DirectPass         lights; shadows by rays, maps or cones -> radiance
//! Technique::shade   indirect light                    -> radiance
//! CompositePass      emitted + direct + indirect       -> Accumulator
//! ```
//!
//! Passes record into the caller's encoder ([`Frame`]). Nothing here submits, waits or reads back,
//! and from the second frame on nothing is allocated as long as textures and buffers stay the same.
//! [`View::advance`] and [`Accumulator`] write their uniforms with `queue.write_buffer`, which takes
//! effect at the next submission: submit each frame before the next one is begun.
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `frame/gbuffer` | scene, view | the five textures of [`GBuffer`] |
//! | `frame/direct` | scene, view, G-buffer | `rgba32float` radiance, a count of rejected pixels |
//! | `frame/composite` | scene (the sky), view, G-buffer, direct, indirect | sums, `rgba32float` beauty |

mod bind_groups;
mod composite;
mod direct;
mod gbuffer;
mod timers;
mod view;

use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::shadow::ShadowMaps;

pub use bind_groups::BindGroupCache;
pub use composite::{Accumulator, CompositePass};
pub(crate) use direct::radiance_target;
pub use direct::{DirectPass, DirectSettings};
pub use gbuffer::{GBuffer, GBufferPass};
pub use timers::PassTimers;
pub use view::{View, ViewSettings};

/// What a pass needs to record its part of a frame.
pub struct Frame<'a> {
    /// The device.
    pub gpu: &'a Gpu,
    /// Where passes are recorded.
    pub encoder: &'a mut wgpu::CommandEncoder,
    /// Bind group 0.
    pub scene: &'a GpuScene,
    /// Camera, frame index, seed, as a uniform buffer ([`View::uniform`]) and on the CPU ([`View::data`]).
    pub view: &'a View,
    /// Where passes write GPU timestamps, if they are to be timed.
    pub timers: Option<&'a mut PassTimers>,
}

/// A technique of indirect light.
///
/// A technique is made by a function of its own (`new(&Gpu, &GpuScene, Settings)`).
pub trait Technique {
    /// Why a frame could not be recorded.
    type Error: std::error::Error + Send + Sync + 'static;

    /// Brings up to date what the technique keeps between frames: injects, gathers, bounces. Called
    /// once a frame, before the G-buffer is read.
    ///
    /// # Errors
    /// The technique does not fit the scene any more. What was recorded until then does no harm.
    fn update(&mut self, frame: &mut Frame) -> Result<(), Self::Error>;

    /// Records indirect light of every pixel and returns where it will stand: a texture of the
    /// picture's size, `rgba16float` or `rgba32float`, rgb: radiance that the surface reflects
    /// towards the camera \[W·sr⁻¹·m⁻²\] of light that was reflected at least once before; 0 where
    /// there is no surface; a: ambient occlusion ([`crate::reference::Channel::Openness`]), 1 if it is not
    /// known. None: there is none.
    ///
    /// The surface as `frame::gbuffer::decode_gbuffer` returns it is what reflects: a white
    /// Lambertian where irradiance is asked for.
    fn shade(&mut self, frame: &mut Frame, gbuffer: &GBuffer) -> Option<wgpu::TextureView>;
}

/// No indirect light: direct light alone.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoIndirect;

impl Technique for NoIndirect {
    type Error = std::convert::Infallible;

    fn update(&mut self, _frame: &mut Frame) -> Result<(), Self::Error> {
        Ok(())
    }

    fn shade(&mut self, _frame: &mut Frame, _gbuffer: &GBuffer) -> Option<wgpu::TextureView> {
        None
    }
}

/// The passes that every technique shares, with their targets.
#[derive(Debug)]
pub struct FramePasses {
    /// What the camera sees.
    pub gbuffer: GBuffer,
    /// Direct light.
    pub direct: DirectPass,
    /// Sums over frames.
    pub accumulator: Accumulator,
    /// Drawn before anything else, in the next frame alone if [`Self::shadows_changed`] says so.
    pub shadow_maps: Option<ShadowMaps>,
    shadows_are_stale: bool,
    gbuffer_pass: GBufferPass,
    composite: CompositePass,
}

impl FramePasses {
    /// Compiles the passes for the scene's variant and makes targets of this size \[pixels\].
    ///
    /// # Errors
    /// As [`GBuffer::new`].
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        size: glam::UVec2,
        direct: DirectSettings,
    ) -> Result<Self, GpuError> {
        Ok(Self {
            gbuffer: GBuffer::new(gpu, size)?,
            direct: DirectPass::new(gpu, scene, size, direct),
            accumulator: Accumulator::new(gpu, size),
            shadow_maps: None,
            shadows_are_stale: true,
            gbuffer_pass: GBufferPass::new(gpu, scene),
            composite: CompositePass::new(gpu, scene),
        })
    }

    /// Says that lights or triangles have changed: shadow maps are drawn anew in the next frame.
    pub fn shadows_changed(&mut self) {
        self.shadows_are_stale = true;
    }

    /// Records what comes before the picture: shadow maps if they are stale, and the technique's update.
    ///
    /// # Errors
    /// Those of [`Technique::update`].
    pub fn update<T: Technique>(
        &mut self,
        frame: &mut Frame,
        technique: &mut T,
    ) -> Result<(), T::Error> {
        if let Some(maps) = self.shadow_maps.as_ref().filter(|_| self.shadows_are_stale) {
            maps.record(frame);
        }
        self.shadows_are_stale = false;
        technique.update(frame)
    }

    /// Records one frame and adds it to the accumulator.
    ///
    /// # Errors
    /// Those of [`Technique::update`].
    ///
    /// # Panics
    /// If the view's size is another than the targets', or the scene's variant another than the one
    /// that the passes were compiled for.
    pub fn record<T: Technique>(
        &mut self,
        frame: &mut Frame,
        technique: &mut T,
    ) -> Result<(), T::Error> {
        self.update(frame, technique)?;
        self.gbuffer_pass.record(frame, &self.gbuffer);
        self.direct.record(frame, &self.gbuffer);
        let indirect = technique.shade(frame, &self.gbuffer);
        self.composite.record(
            frame,
            &self.gbuffer,
            self.direct.radiance(),
            indirect.as_ref(),
            &mut self.accumulator,
        );
        Ok(())
    }
}
