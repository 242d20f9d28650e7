// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-cone`: voxel cone tracing.
//!
//! The light that leaves the voxels' faces is stored in a pyramid of ever coarser voxels. Widening cones gather it, for
//! voxels (further bounces) and for pixels. The method is described in `docs/techniques/voxel-cone.md`.
//!
//! ```text
//! VoxelLight (structure, direct light of faces) ─▶ FillPass ──▶ PrefilterPass ──▶ BouncePass ─┐
//! VoxelAttributes (albedo, opacity) ────────────────▲                 │    feedback of faces ◀─┘
//!  when something moved                                               ▼
//!                                                 ShadePass: pixels → indirect radiance, ambient occlusion
//! ```
//!
//! Voxels, levels around the eye and direct light are those of [`VoxelLight`]. As there, faces that remain keep their
//! light when things move.

mod bounce;
mod occlusion;
mod settings;
mod shade;

use super::{Notice, Setting, SettingValue, Settings, Stat, Technique, TechniqueError};
use crate::components::LightVisibility;
use crate::components::voxel_light::{
    Bounces, CacheBuffers, Eye, PublishInfo, PublishPass, VoxelLight, VoxelLightSettings,
    VoxelReach,
};
use crate::components::voxel_pyramid::{FillInfo, FillPass, PeakPass, PrefilterPass};
use crate::components::voxels::{RECORD_GROUPS_OFFSET, VoxelAttributes, VoxelGrid};
use crate::frame::Pixels;
use crate::gpu::{Dispatch, Gpu, Recorder};
use crate::seam::SceneSeam;
use bounce::BouncePass;
use glam::Vec3;
use occlusion::OcclusionPass;
use shade::ShadePass;

pub use crate::components::voxel_pyramid::{ConeStepping, FaceWeights, Pyramid, PyramidStorage};
pub use settings::{Specular, VoxelConeSettings};

/// The technique: prefiltered voxels of a scene, and cones through them.
#[derive(Debug)]
pub struct VoxelCone {
    chosen: VoxelConeSettings,
    /// The settings without those that make no difference in the scene.
    settings: VoxelConeSettings,
    light: VoxelLight,
    attributes: Vec<VoxelAttributes>,
    pyramid: Pyramid,
    peak: PeakPass,
    fill: FillPass,
    prefilter: PrefilterPass,
    bounce: BouncePass,
    /// For a limited number of bounces: direct light plus the light reflected so far.
    publish: PublishPass,
    occlusion: Option<OcclusionPass>,
    shade: ShadePass,
}

impl VoxelCone {
    /// Creates the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// `eye` \[m\]: the camera's position. The levels are laid out for what can be seen from there.
    ///
    /// # Errors
    /// [`TechniqueError`]: a setting is out of range, or a buffer or texture is larger than the device allows.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: VoxelConeSettings,
        eye: Vec3,
    ) -> Result<Self, TechniqueError> {
        Self::with_visibility(gpu, scene, settings, &LightVisibility::rays(), eye)
    }

    /// As [`Self::new`], but `visibility` instead of rays decides which lights voxels see. (Shadow maps are drawn
    /// before the technique's update: [`FramePasses::shadow_maps`](crate::frame::FramePasses).)
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_visibility(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: VoxelConeSettings,
        visibility: &LightVisibility,
        eye: Vec3,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        let of_voxels = VoxelLightSettings {
            resolution: settings.resolution,
            anisotropic: settings.anisotropic,
            levels: settings.levels,
            points_per_face: settings.points_per_face,
            bounces: settings.bounces,
            finds_reflected: false,
            seed: settings.seed,
            ..VoxelLightSettings::default()
        };
        let light = VoxelLight::new(gpu, scene, of_voxels, visibility, eye)?;
        let attributes = light
            .voxelizers()
            .map(|voxelizer| VoxelAttributes::new(gpu, scene, voxelizer))
            .collect::<Result<Vec<_>, _>>()?;
        let grids: Vec<VoxelGrid> = light.voxelizers().map(|of| *of.grid()).collect();
        let squared = settings.face_weights == FaceWeights::Squared;
        let pyramid = Pyramid::new(gpu, &grids, settings.storage, squared)?;
        // There is no specular light if every surface is Lambertian.
        let mirrors = settings.specular != Specular::Off && !scene.facts().diffuse_only;
        let chosen = settings;
        let group = Some(scene.group());
        let settings = VoxelConeSettings {
            occludes_specular: settings.occludes_specular && mirrors,
            ..settings
        };
        Ok(Self {
            chosen,
            peak: PeakPass::new(gpu),
            fill: FillPass::new(gpu, &pyramid),
            prefilter: PrefilterPass::new(gpu, &pyramid),
            bounce: BouncePass::new(gpu, &pyramid),
            publish: PublishPass::new(gpu),
            shade: ShadePass::new(gpu, scene.shaders(), group, &pyramid),
            occlusion: OcclusionPass::new(gpu, scene.shaders(), group, &settings),
            settings,
            attributes,
            pyramid,
            light,
        })
    }

    /// The settings.
    pub fn chosen(&self) -> &VoxelConeSettings {
        &self.chosen
    }

    /// The component that stores the voxels' light.
    pub fn light(&self) -> &VoxelLight {
        &self.light
    }

    /// The grid of a level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn grid(&self, level: usize) -> &VoxelGrid {
        self.light.grid(level)
    }

    /// How fine the cells are, compared with what was around the eye when this was made.
    pub fn reach(&self) -> &VoxelReach {
        self.light.reach()
    }

    /// What is kept about the voxels between frames.
    pub fn buffers(&self) -> &CacheBuffers {
        self.light.buffers()
    }

    /// The prefiltered voxels.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Writes the light of faces into the pyramid.
    fn build(&self, recorder: &mut Recorder) {
        let info = FillInfo {
            level: 0,
            fills_gaps: u32::from(self.settings.fills_gaps),
            backs_hide: u32::from(self.settings.opaque_backs),
            reserved: 0,
        };
        self.peak.record(recorder, &self.light, &self.pyramid);
        self.fill.record(recorder, &self.pyramid, self.light.buffers(), &self.attributes, info);
        self.prefilter.record(recorder, &self.pyramid);
    }

    fn reflect(&self, recorder: &mut Recorder, period: u32) {
        let Self { light, attributes, pyramid, settings, .. } = self;
        self.bounce.record(recorder, light, attributes, pyramid, settings, period);
    }

    /// Adds the light reflected so far to the light that the pyramid is made of.
    fn publish(&self, recorder: &mut Recorder) {
        let pass = &mut recorder.compute("voxel_light/publish");
        for (level, voxelizer) in (0..).zip(self.light.voxelizers()) {
            let info = PublishInfo { level, feedback: 1, light_rays: 1.0, reserved: 0 };
            let records = Dispatch::Indirect(voxelizer.counts(), RECORD_GROUPS_OFFSET);
            self.publish.record(pass, self.light.buffers(), &info, records);
        }
    }
}

impl Technique for VoxelCone {
    fn name(&self) -> &'static str {
        "voxel-cone"
    }

    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
    ) -> Result<(), TechniqueError> {
        self.light.update(recorder, scene, eye)?;
        if self.light.has_new_structure() {
            let levels = self.attributes.iter().zip(self.light.voxelizers()).enumerate();
            for (ix, (attributes, voxelizer)) in levels {
                attributes.record(recorder, scene, voxelizer)?;
                self.pyramid.move_level(recorder, ix, voxelizer.grid().origin);
            }
        }
        self.build(recorder);
        match self.settings.bounces {
            Bounces::Unlimited => self.reflect(recorder, self.settings.bounce_period),
            Bounces::UpTo(n) => {
                for _ in 1..n {
                    self.reflect(recorder, 1);
                    self.publish(recorder);
                    self.build(recorder);
                }
            }
        }
        Ok(())
    }

    fn finds_openness(&self) -> bool {
        true
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        pixels.check_target("target", target)?;
        let Self { occlusion, pyramid, settings, .. } = self;
        let occlusion = occlusion.as_mut().map(|of| of.record(recorder, pyramid, settings, pixels));
        self.shade.record(recorder, pyramid, settings, pixels, occlusion.as_ref(), target);
        Ok(())
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        self.chosen.described()
    }

    fn stats(&self) -> Vec<Stat> {
        let mut stats = self.light.stats();
        stats.push(Stat::known("prefiltered voxels", "bytes", self.pyramid.bytes()));
        stats
    }

    fn notices(&self) -> Vec<Notice> {
        self.light.notices()
    }

    /// Cones through the voxels: soft shadows without noise, which miss what is smaller than a voxel.
    fn visibility(&self) -> Option<LightVisibility> {
        Some(self.pyramid.visibility())
    }
}
