// SPDX-License-Identifier: MIT OR Apache-2.0
//! The frame that all real-time techniques share: a G-buffer, direct light, the technique's indirect light, and their
//! sum over frames.
//!
//! ```text
//! View::advance      camera, jitter, matrices          -> what kernels bind as `view`
//! ShadowMaps         what lights see, if used          -> depth maps
//! Technique::update  what the technique keeps up to date
//! GBufferPass        rasterises the scene              -> GBuffer
//! DirectPass         lights; shadows by rays, maps or cones -> radiance
//! Technique::shade   indirect light                    -> radiance
//! CompositePass      emitted + direct + indirect       -> Accumulator
//! ```
//!
//! Passes record into the caller's command encoder ([`Recorder`]). Nothing here submits, waits or reads back, and from
//! the third frame on nothing is allocated as long as textures and buffers stay the same. Everything takes effect in
//! the order of recording, so one submission can contain several views, techniques and frames.
//!
//! | pass | reads | writes |
//! |---|---|---|
//! | `frame/gbuffer` | scene, view | the five textures of [`GBuffer`] |
//! | `frame/direct` | scene, view, pixels | `rgba32float` radiance, a count of rejected pixels |
//! | `frame/composite` | scene (the sky), view, pixels, direct, indirect | sums, `rgba32float` beauty |

mod camera;
mod composite;
mod direct;
mod gbuffer;
mod technique;
mod view;

use crate::components::LightVisibility;
use crate::components::shadow_maps::ShadowMaps;
use crate::components::voxel_light::Eye;
use crate::gpu::{Bindings, Gpu, GpuError, Recorder, Resource, SceneGroup, radiance_target};
use crate::seam::{Mismatch, SceneSeam};
use glam::UVec2;

pub use crate::bindings::lucerna::camera::primary_ray::Camera as ShaderCamera;
pub use crate::bindings::lucerna::frame::view::FrameView;
pub(crate) use camera::camera_for_size;
pub use composite::{Accumulator, CompositePass};
pub use direct::{DirectPass, DirectSettings};
pub use gbuffer::{GBuffer, GBufferPass};
pub use technique::{DebugView, Technique, TechniqueError};
pub use view::{View, ViewSettings};

/// The surfaces that the pixels of a picture see: bindings of `lucerna::scene::pixel`. [`GBuffer`] is lucerna's own
/// implementation; a renderer with another G-buffer replaces that module
/// ([`Shaders::with_module`](crate::gpu::Shaders::with_module)) and implements this trait.
pub trait PixelSurfaces {
    /// Width and height \[pixels\].
    fn size(&self) -> UVec2;

    /// The module's bindings in group 2 other than `view`, by the names of its variables.
    fn bindings(&self) -> Bindings<'_>;

    /// Bind group 0, if the module uses the scene.
    fn scene(&self) -> Option<&SceneGroup> {
        None
    }
}

impl From<&View> for Eye {
    fn from(view: &View) -> Self {
        Self::of_camera(view.data().camera)
    }
}

/// A picture's camera, and the surfaces that its pixels see.
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Pixels<'a> {
    /// The camera.
    pub view: &'a View,
    /// The surfaces.
    pub surfaces: &'a dyn PixelSurfaces,
}

impl<'a> Pixels<'a> {
    /// Combines the two.
    ///
    /// # Errors
    /// [`Mismatch::Size`]
    pub fn new(view: &'a View, surfaces: &'a dyn PixelSurfaces) -> Result<Self, Mismatch> {
        check_size("G-buffer", view.size(), surfaces.size())?;
        Ok(Self { view, surfaces })
    }

    /// Fails if a target has another size than the picture.
    ///
    /// # Errors
    /// [`Mismatch::Size`]
    pub fn check_target(
        &self,
        what: &'static str,
        target: &wgpu::TextureView,
    ) -> Result<(), Mismatch> {
        let size = target.texture().size();
        check_size(what, self.size(), UVec2::new(size.width, size.height))
    }

    /// Width and height \[pixels\].
    pub fn size(&self) -> UVec2 {
        self.view.size()
    }

    /// Bind group 0, if the pixels' surfaces are found in the scene.
    pub fn scene(&self) -> Option<&'a SceneGroup> {
        self.surfaces.scene()
    }

    /// The bindings of kernels in group 2.
    pub fn bindings(&self) -> Bindings<'a> {
        let mut bindings = self.surfaces.bindings();
        bindings.push(("view", Resource::Uniform(bytemuck::bytes_of(self.view.data()))));
        bindings
    }
}

pub(crate) fn check_size(
    what: &'static str,
    expected: UVec2,
    found: UVec2,
) -> Result<(), Mismatch> {
    if expected == found { Ok(()) } else { Err(Mismatch::Size { what, expected, found }) }
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
    /// Drawn before anything else if the scene has changed.
    pub shadow_maps: Option<ShadowMaps>,
    /// Shown instead of the technique's light: one of its debug views.
    pub debug_view: Option<String>,
    indirect: wgpu::TextureView,
    gbuffer_pass: GBufferPass,
    composite: CompositePass,
}

impl FramePasses {
    /// Compiles the passes for the scene's variant and creates targets of this size \[pixels\]. Rays decide which
    /// lights are visible.
    ///
    /// # Errors
    /// As [`GBuffer::new`], or [`Mismatch::NoRaster`].
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        size: UVec2,
        direct: DirectSettings,
    ) -> Result<Self, FrameError> {
        Self::with_visibility(gpu, scene, size, direct, &LightVisibility::rays())
    }

    /// As [`Self::new`], but `visibility` decides which lights pixels see. (If it is that of shadow maps, put these
    /// into [`Self::shadow_maps`].)
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_visibility(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        size: UVec2,
        direct: DirectSettings,
        visibility: &LightVisibility,
    ) -> Result<Self, FrameError> {
        let gbuffer = GBuffer::new(gpu, size)?;
        Ok(Self {
            gbuffer,
            direct: DirectPass::new(gpu, scene, size, direct, visibility),
            accumulator: Accumulator::new(gpu, size),
            shadow_maps: None,
            debug_view: None,
            indirect: radiance_target(gpu, "indirect", size),
            gbuffer_pass: GBufferPass::new(gpu, scene)?,
            composite: CompositePass::new(gpu, scene),
        })
    }

    /// Records what comes before the picture: shadow maps, if the scene has changed, and the technique's update.
    ///
    /// # Errors
    /// Those of [`Technique::update`] and [`ShadowMaps::record`].
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        view: &View,
        technique: &mut dyn Technique,
    ) -> Result<(), TechniqueError> {
        if let Some(maps) = &mut self.shadow_maps {
            maps.record(recorder, scene)?;
        }
        technique.update(recorder, scene, &Eye::from(view))
    }

    /// Records one frame and adds it to the accumulator.
    ///
    /// # Errors
    /// As [`Self::update`], or the view has another size than the targets, or the technique has no such debug view; in the
    /// last case nothing is recorded.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        view: &View,
        technique: &mut dyn Technique,
    ) -> Result<(), TechniqueError> {
        if let Some(name) = &self.debug_view
            && !technique.debug_views().iter().any(|known| known.name == name)
        {
            return Err(TechniqueError::NoDebugView(name.clone()));
        }
        self.update(recorder, scene, view, technique)?;
        self.gbuffer_pass.record(recorder, scene, view, &self.gbuffer)?;
        let pixels = Pixels::new(view, &self.gbuffer)?;
        self.direct.record(recorder, scene, &pixels)?;
        let shades = technique.shades();
        match &self.debug_view {
            Some(name) => technique.shade_debug_view(recorder, &pixels, &self.indirect, name)?,
            None if shades => technique.shade(recorder, &pixels, &self.indirect)?,
            None => {}
        }
        let has_indirect = shades || self.debug_view.is_some();
        let indirect = has_indirect.then_some(&self.indirect);
        let (direct, sums) = (self.direct.radiance(), &mut self.accumulator);
        self.composite.record(recorder, scene, &pixels, direct, indirect, sums)?;
        Ok(())
    }

    /// Indirect light of the last frame, `rgba32float`.
    pub fn indirect(&self) -> &wgpu::TextureView {
        &self.indirect
    }
}

/// The passes of a frame could not be created.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The scene cannot be rasterised.
    #[error(transparent)]
    Scene(#[from] Mismatch),
}
