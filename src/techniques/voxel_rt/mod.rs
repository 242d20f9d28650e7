// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-rt`: ray-traced voxel global illumination.
//!
//! Irradiance is stored for the faces of the voxels that contain surfaces ([`VoxelLight`]). Every frame updates it with
//! a few rays per face, independently of the picture's size; pixels look it up. The method is described in
//! `docs/techniques/voxel-rt.md`.

mod settings;
mod shade;

use super::{DebugView, Notice, Setting, SettingValue, Settings, Stat, Technique, TechniqueError};
use crate::components::LightVisibility;
use crate::components::voxel_light::{Bounces, CacheBuffers, Eye, VoxelLight, VoxelReach};
use crate::components::voxels::VoxelGrid;
use crate::frame::Pixels;
use crate::gpu::{Gpu, Recorder};
use crate::seam::SceneSeam;
use glam::Vec3;

pub use settings::{Lookup, VoxelRtSettings};
pub use shade::{ShadePass, Shown};

/// The technique: light of voxels, looked up by pixels.
#[derive(Debug)]
pub struct VoxelRt {
    settings: VoxelRtSettings,
    light: VoxelLight,
    shade: ShadePass,
}

impl VoxelRt {
    /// Creates the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// `eye` \[m\]: the camera's position. The levels are laid out for what can be seen from there.
    ///
    /// # Errors
    /// [`TechniqueError`]: a setting is out of range, or a buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: VoxelRtSettings,
        eye: Vec3,
    ) -> Result<Self, TechniqueError> {
        Self::with_visibility(gpu, scene, settings, &LightVisibility::rays(), eye)
    }

    /// As [`Self::new`], but `visibility` instead of rays decides which lights voxels see.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_visibility(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: VoxelRtSettings,
        visibility: &LightVisibility,
        eye: Vec3,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        Ok(Self {
            settings,
            light: VoxelLight::new(gpu, scene, settings.into(), visibility, eye)?,
            shade: ShadePass::new(gpu, scene.shaders(), Some(scene.group())),
        })
    }

    /// The component that stores its light.
    pub fn light(&self) -> &VoxelLight {
        &self.light
    }

    /// The settings.
    pub fn chosen(&self) -> &VoxelRtSettings {
        &self.settings
    }

    /// How fine the cells are, compared with what was around the eye when this was made.
    pub fn reach(&self) -> &VoxelReach {
        self.light.reach()
    }

    /// The grid of a level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn grid(&self, level: usize) -> &VoxelGrid {
        self.light.grid(level)
    }

    /// What is kept between frames.
    pub fn buffers(&self) -> &CacheBuffers {
        self.light.buffers()
    }
}

impl Technique for VoxelRt {
    fn name(&self) -> &'static str {
        "voxel-rt"
    }

    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
    ) -> Result<(), TechniqueError> {
        self.light.update(recorder, scene, eye)?;
        self.light.compare(recorder, |buffers| &buffers.shown);
        Ok(())
    }

    fn shades(&self) -> bool {
        self.settings.bounces != Bounces::UpTo(0)
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        pixels.check_target("target", target)?;
        let buffers = self.light.buffers();
        self.shade.record(recorder, buffers, pixels, self.settings.lookup, Shown::Light, target);
        Ok(())
    }

    fn debug_views(&self) -> &'static [DebugView] {
        shade::DEBUG_VIEWS
    }

    fn shade_debug_view(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
        name: &str,
    ) -> Result<(), TechniqueError> {
        pixels.check_target("target", target)?;
        let shown = Shown::of_name(name);
        let shown = shown.ok_or_else(|| TechniqueError::NoDebugView(name.to_owned()))?;
        let buffers = self.light.buffers();
        self.shade.record(recorder, buffers, pixels, self.settings.lookup, shown, target);
        Ok(())
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        self.settings.described()
    }

    fn stats(&self) -> Vec<Stat> {
        self.light.stats()
    }

    fn light_to_come(&self) -> Option<Stat> {
        Some(self.light.to_come())
    }

    fn notices(&self) -> Vec<Notice> {
        self.light.notices()
    }
}
