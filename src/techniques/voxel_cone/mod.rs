// SPDX-License-Identifier: MIT OR Apache-2.0
//! `voxel-cone`: voxel cone tracing.
//!
//! Cones gather the light that leaves the voxels' faces, for voxels (further bounces) and for pixels: along their axes from
//! surface to surface, or widening, through a pyramid of ever coarser voxels ([`Tracing`]). The method is described in
//! `docs/techniques/voxel-cone.md`.
//!
//! ```text
//! VoxelLight (structure, direct light of faces) ─┬──────────────────────────────▶ BouncePass ─┐
//! Surfels: when something moved ─────────────────┤                         feedback of faces ◀┘
//!                                                └──▶ ShadePass: pixels → indirect radiance, ambient occlusion
//!
//! VoxelLight ─▶ FillPass ──▶ PrefilterPass ─┬──▶ BouncePass
//! VoxelAttributes ──▲                       └──▶ ShadePass
//!  when something moved
//! ```
//!
//! Voxels, levels around the eye and direct light are those of [`VoxelLight`]. As there, faces that remain keep their
//! light when things move.

mod bounce;
mod occlusion;
mod prefiltered;
mod settings;
mod shade;

use super::{Notice, Setting, SettingValue, Settings, Stat, Technique, TechniqueError};
use crate::components::LightVisibility;
use crate::components::voxel_light::{
    Bounces, CacheBuffers, Eye, PublishInfo, PublishPass, SETTLED_PERIOD, VoxelLight,
    VoxelLightSettings, VoxelReach,
};
use crate::components::voxel_surfels::Surfels;
use crate::components::voxels::VoxelGrid;
use crate::frame::Pixels;
use crate::gpu::{Bindings, Gpu, Recorder};
use crate::seam::SceneSeam;
use crate::shader::SURFEL_CONES;
use bounce::BouncePass;
use glam::Vec3;
use occlusion::OcclusionPass;
use prefiltered::Prefiltered;
use shade::ShadePass;

pub use crate::components::voxel_pyramid::{ConeStepping, FaceWeights, Pyramid, PyramidStorage};
pub use settings::{Specular, Tracing, VoxelConeSettings};

/// The technique: voxels of a scene with their light, and cones through them.
#[derive(Debug)]
pub struct VoxelCone {
    chosen: VoxelConeSettings,
    /// The settings without those that make no difference in the scene.
    settings: VoxelConeSettings,
    light: VoxelLight,
    seen: Seen,
    bounce: BouncePass,
    /// For a limited number of bounces: direct light plus the light reflected so far.
    publish: PublishPass,
    occlusion: Option<OcclusionPass>,
    shade: ShadePass,
}

/// What cones see.
#[derive(Debug)]
enum Seen {
    Surfels(Surfels),
    Prefiltered(Box<Prefiltered>),
}

impl Seen {
    /// The bindings of kernels that trace cones.
    fn field<'a>(&'a self, light: &'a VoxelLight) -> Bindings<'a> {
        match self {
            Self::Surfels(surfels) => surfels.field(light.buffers()),
            Self::Prefiltered(of) => of.pyramid.field(),
        }
    }
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
        settings.check_tracing()?;
        let of_voxels = VoxelLightSettings {
            resolution: settings.resolution,
            anisotropic: settings.anisotropic,
            levels: settings.levels,
            points_per_face: settings.points_per_face,
            bounces: settings.bounces,
            finds_reflected: false,
            divides: settings.tracing == Tracing::Surfels,
            seed: settings.seed,
            ..VoxelLightSettings::default()
        };
        let light = VoxelLight::new(gpu, scene, of_voxels, visibility, eye)?;
        // There is no specular light if every surface is Lambertian.
        let mirrors = settings.specular != Specular::Off && !scene.facts().diffuse_only;
        let chosen = settings;
        let group = Some(scene.group());
        let (seen, variant) = match settings.tracing {
            Tracing::Surfels => {
                let variant = scene.shaders().variant().with(SURFEL_CONES);
                (Seen::Surfels(Surfels::new(gpu, scene, &light)?), variant)
            }
            Tracing::Prefiltered => {
                let made = Prefiltered::new(gpu, scene, &light, &settings)?;
                let variant = made.pyramid.variant(scene.shaders().variant());
                (Seen::Prefiltered(Box::new(made)), variant)
            }
        };
        // (Surfels are exact close by.)
        let is_prefiltered = settings.tracing == Tracing::Prefiltered;
        let settings = VoxelConeSettings {
            occludes_specular: settings.occludes_specular && mirrors && is_prefiltered,
            occludes_diffuse: settings.occludes_diffuse && is_prefiltered,
            ..settings
        };
        let shaders = scene.shaders().with_variant(variant);
        Ok(Self {
            chosen,
            bounce: BouncePass::new(gpu, &shaders, settings.tracing),
            publish: PublishPass::new(gpu),
            shade: ShadePass::new(gpu, &shaders, group),
            occlusion: OcclusionPass::new(gpu, scene.shaders(), group, &settings),
            settings,
            seen,
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

    /// The prefiltered voxels; None with [`Tracing::Surfels`].
    pub fn pyramid(&self) -> Option<&Pyramid> {
        match &self.seen {
            Seen::Surfels(_) => None,
            Seen::Prefiltered(of) => Some(&of.pyramid),
        }
    }

    /// The surfels; None with [`Tracing::Prefiltered`].
    pub fn surfels(&self) -> Option<&Surfels> {
        match &self.seen {
            Seen::Surfels(surfels) => Some(surfels),
            Seen::Prefiltered(_) => None,
        }
    }

    /// The bindings of kernels that trace cones ([`TracePass`](crate::components::voxel_pyramid::TracePass)).
    pub fn field(&self) -> Bindings<'_> {
        self.seen.field(&self.light)
    }

    /// Shows cones the light of faces.
    fn build(&self, recorder: &mut Recorder) {
        if let Seen::Prefiltered(of) = &self.seen {
            of.build(recorder, &self.light, &self.settings);
        }
    }

    fn reflect(&self, recorder: &mut Recorder, period: u32, settled_period: u32) {
        let Self { light, seen, settings, .. } = self;
        self.bounce.record(recorder, light, seen, settings, period, settled_period);
    }

    /// Adds the light reflected so far to what faces reflect.
    fn publish(&self, recorder: &mut Recorder) {
        let pass = &mut recorder.compute("voxel_light/publish");
        let buffers = self.light.buffers();
        for level in 0..self.light.n_levels() as u32 {
            let info = PublishInfo { level, feedback: 1, light_rays: 1.0, frame: 0 };
            self.publish.record(pass, buffers, &info, buffers.records(level));
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
            match &mut self.seen {
                Seen::Surfels(surfels) => surfels.record(recorder, scene, &self.light),
                Seen::Prefiltered(of) => of.follow(recorder, scene, &self.light)?,
            }
        }
        self.build(recorder);
        match self.settings.bounces {
            Bounces::Unlimited => {
                let period = self.settings.bounce_period;
                self.reflect(recorder, period, period.saturating_mul(SETTLED_PERIOD));
            }
            Bounces::UpTo(n) => {
                for _ in 1..n {
                    self.reflect(recorder, 1, 1);
                    self.publish(recorder);
                    self.build(recorder);
                }
            }
        }
        self.light.compare(recorder, |buffers| &buffers.reflected);
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
        let Self { occlusion, seen, settings, light, .. } = self;
        let occlusion = match (occlusion, &*seen) {
            (Some(pass), Seen::Prefiltered(of)) => {
                Some(pass.record(recorder, &of.pyramid, settings, pixels))
            }
            _ => None,
        };
        let field = seen.field(light);
        self.shade.record(recorder, field, settings, pixels, occlusion.as_ref(), target);
        Ok(())
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        self.chosen.described()
    }

    fn stats(&self) -> Vec<Stat> {
        let mut stats = self.light.stats();
        stats.push(match &self.seen {
            Seen::Surfels(surfels) => Stat::known("surfels", "bytes", surfels.buffer().size()),
            Seen::Prefiltered(of) => Stat::known("prefiltered voxels", "bytes", of.pyramid.bytes()),
        });
        stats
    }

    fn light_to_come(&self) -> Option<Stat> {
        Some(self.light.to_come())
    }

    fn notices(&self) -> Vec<Notice> {
        let mut notices = self.light.notices();
        let idle = self.chosen.idle();
        if !idle.is_empty() {
            let text = format!(
                "without --tracing prefiltered these make no difference: {}",
                idle.join(", ")
            );
            notices.push(Notice::warning(text));
        }
        notices
    }

    /// Cones through prefiltered voxels: soft shadows without noise, which miss what is smaller than a voxel.
    fn visibility(&self) -> Option<LightVisibility> {
        self.pyramid().map(Pyramid::visibility)
    }
}
