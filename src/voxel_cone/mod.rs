//! `voxel-cone`: voxel cone tracing.
//!
//! Light that leaves the voxels' faces is kept in a pyramid of ever coarser voxels; cones that grow as they
//! go gather it, for voxels (further bounces) and for pixels. The method is described in
//! `docs/techniques/voxel-cone.md`.
//!
//! ```text
//! VoxelRt (structure, direct light of faces) ──▶ FillPass ──▶ PrefilterPass ──▶ BouncePass ─┐
//! VoxelAttributes (albedo, opacity) ─────────────▲                 │    feedback of faces ◀─┘
//!  when something moved                                            ▼
//!                                              ShadePass: G-buffer → indirect radiance, ambient occlusion
//! ```
//!
//! Voxels, levels around the eye and direct light are those of [`voxel_rt`](crate::voxel_rt); faces that stay
//! keep their light when things move, as there.

mod bounce;
mod fill;
mod occlusion;
mod peak;
mod pyramid;
mod settings;
mod shade;
mod trace;

use crate::frame::{Frame, GBuffer, Technique};
use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::shadow::{ShadowBinding, ShadowError, ShadowMaps};
use crate::voxel::{Resolution, VoxelAttributes, VoxelError, VoxelGrid};
use crate::voxel_rt::{
    Bounces, CacheBuffers, Change, PublishInfo, PublishPass, VoxelReach, VoxelRt, VoxelRtError,
    VoxelRtSettings,
};
use bounce::BouncePass;
use fill::FillPass;
use glam::Vec3;
use occlusion::OcclusionPass;
use peak::PeakPass;
use shade::ShadePass;

pub use fill::PrefilterPass;
pub use pyramid::{Pyramid, PyramidLayout, PyramidLevel, PyramidMip};
pub use settings::{ConeStepping, FaceWeights, PyramidStorage, Specular, VoxelConeSettings};
pub use trace::{Cone, ConeResult, TracePass};

/// `voxel-cone` could not be set up, or a frame not be recorded.
#[derive(Debug, thiserror::Error)]
pub enum VoxelConeError {
    /// A setting is out of range.
    #[error("{name} is {value}; possible is {possible}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: String,
        /// What may be given.
        possible: &'static str,
    },
    /// The voxels and their direct light.
    #[error(transparent)]
    Voxels(#[from] VoxelRtError),
    /// What the voxels look like.
    #[error(transparent)]
    Attributes(#[from] VoxelError),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The technique: prefiltered voxels of a scene, and cones through them.
#[derive(Debug)]
pub struct VoxelCone {
    settings: VoxelConeSettings,
    light: VoxelRt,
    attributes: Vec<VoxelAttributes>,
    pyramid: Pyramid,
    peak: PeakPass,
    fill: FillPass,
    prefilter: PrefilterPass,
    bounce: BouncePass,
    /// Of counted bounces: direct light and what was reflected so far.
    publish: PublishPass,
    occlusion: Option<OcclusionPass>,
    shade: ShadePass,
}

impl VoxelCone {
    /// Makes the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// `eye` \[m\]: where the camera stands. The levels are laid out for what can be seen from there.
    ///
    /// # Errors
    /// [`VoxelConeError`]: a setting is out of range, or a buffer or texture is larger than the device takes.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelConeSettings,
        eye: Vec3,
    ) -> Result<Self, VoxelConeError> {
        Self::make(gpu, scene, settings, None, eye)
    }

    /// As [`Self::new`], with shadow maps in the place of rays for the direct light of voxels. The maps are drawn
    /// ahead of the technique's update ([`FramePasses::shadow_maps`](crate::frame::FramePasses)).
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_shadow_maps(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelConeSettings,
        maps: &ShadowMaps,
        eye: Vec3,
    ) -> Result<Self, VoxelConeError> {
        Self::make(gpu, scene, settings, Some(maps), eye)
    }

    fn make(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelConeSettings,
        shadows: Option<&ShadowMaps>,
        eye: Vec3,
    ) -> Result<Self, VoxelConeError> {
        settings.check()?;
        let longest = match settings.resolution {
            Resolution::Longest(n) => n,
            Resolution::Size(size) => size.max_element(),
        };
        let of_voxels = VoxelRtSettings {
            resolution: longest,
            anisotropic: settings.anisotropic,
            levels: settings.levels,
            points_per_face: settings.points_per_face,
            bounces: settings.bounces,
            seed: settings.seed,
            ..VoxelRtSettings::default()
        };
        let light = VoxelRt::for_others(gpu, scene, of_voxels, settings.resolution, shadows, eye)?;
        let attributes = light
            .voxelizers()
            .map(|voxelizer| VoxelAttributes::new(gpu, scene, voxelizer))
            .collect::<Result<Vec<_>, _>>()?;
        let grids: Vec<VoxelGrid> = light.voxelizers().map(|of| *of.grid()).collect();
        let squared = settings.face_weights == FaceWeights::Squared;
        let pyramid = Pyramid::new(gpu, &grids, settings.storage, squared)?;
        let buffers = light.buffers();
        // Nothing mirrors where everything is Lambert.
        let mirrors = settings.specular != Specular::Off && !scene.is_diffuse_only();
        let settings = VoxelConeSettings {
            occludes_specular: settings.occludes_specular && mirrors,
            ..settings
        };
        let occlusion = OcclusionPass::new(gpu, &pyramid, &settings);
        Ok(Self {
            peak: PeakPass::new(gpu, buffers),
            fill: FillPass::new(gpu, &pyramid, buffers, &attributes, &settings),
            prefilter: PrefilterPass::new(gpu, &pyramid),
            bounce: BouncePass::new(gpu, &pyramid, buffers, &attributes),
            publish: PublishPass::new(gpu, buffers),
            shade: ShadePass::new(gpu, &pyramid, &settings, occlusion.is_some()),
            occlusion,
            settings,
            attributes,
            pyramid,
            light,
        })
    }

    /// What was chosen.
    pub fn settings(&self) -> &VoxelConeSettings {
        &self.settings
    }

    /// Where a level's cells stand.
    pub fn grid(&self, level: usize) -> &VoxelGrid {
        self.light.grid(level)
    }

    /// How fine the cells are for what stood around the eye when this was made; see [`VoxelRt::reach`].
    pub fn reach(&self) -> &VoxelReach {
        self.light.reach()
    }

    /// What is kept of the voxels between frames.
    pub fn buffers(&self) -> &CacheBuffers {
        self.light.buffers()
    }

    /// Shadows by cones through the voxels, for [`DirectPass::with_shadows`](crate::frame::DirectPass).
    ///
    /// # Errors
    /// [`ShadowError::Buffers`]: the voxels are not in textures.
    pub fn cone_shadows(&self, gpu: &Gpu) -> Result<ShadowBinding, ShadowError> {
        if self.settings.storage == PyramidStorage::Buffers {
            return Err(ShadowError::Buffers);
        }
        let (layout, group) = self.pyramid.reading(gpu);
        Ok(ShadowBinding { variant: "cone_shadow", layout, group })
    }

    /// The prefiltered voxels.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Says what has changed since the last frame; see [`VoxelRt::changed`].
    pub fn changed(&mut self, change: Change) {
        self.light.changed(change);
    }

    /// Records one frame of light: voxels, their light, the pyramid, bounces. At most one a submission:
    /// uniforms are written when it is submitted.
    ///
    /// # Errors
    /// The scene has another number of triangles than the one that this was made for.
    ///
    /// # Panics
    /// If the scene's variant is another.
    pub fn renew(&mut self, frame: &mut Frame) -> Result<(), VoxelConeError> {
        self.light.renew(frame)?;
        if self.light.has_new_structure() {
            for (ix, (attributes, voxelizer)) in
                self.attributes.iter().zip(self.light.voxelizers()).enumerate()
            {
                let written = frame.timers.as_mut().and_then(|t| t.compute("voxel/attributes"));
                attributes.record(frame.encoder, frame.scene, voxelizer, written)?;
                self.pyramid.move_level(frame.gpu, ix, voxelizer.grid().origin);
            }
        }
        self.build(frame);
        match self.settings.bounces {
            Bounces::Unlimited => {
                let period = self.settings.bounce_period;
                self.bounce.record(frame, &self.light, &self.settings, period);
            }
            Bounces::UpTo(n) => {
                for _ in 1..n {
                    self.bounce.record(frame, &self.light, &self.settings, 1);
                    self.publish(frame);
                    self.build(frame);
                }
            }
        }
        Ok(())
    }

    /// Brings the light of faces into the pyramid.
    fn build(&self, frame: &mut Frame) {
        self.peak.record(frame, &self.light, &self.pyramid);
        self.fill.record(frame);
        let written = frame.timers.as_mut().and_then(|t| t.compute("voxel_cone/prefilter"));
        self.prefilter.record(frame.encoder, written);
    }

    /// Adds what was reflected so far to what the pyramid is made of.
    fn publish(&self, frame: &mut Frame) {
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/publish"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/publish")),
        });
        for (level, voxelizer) in (0..).zip(self.light.voxelizers()) {
            let info = PublishInfo { level, feedback: 1, light_rays: 1.0, reserved: 0 };
            let arguments = (voxelizer.counts(), crate::voxel::RECORD_GROUPS_OFFSET);
            self.publish.record(frame.gpu, &mut pass, &info, arguments);
        }
    }
}

impl Technique for VoxelCone {
    type Error = VoxelConeError;

    fn update(&mut self, frame: &mut Frame) -> Result<(), VoxelConeError> {
        self.renew(frame)
    }

    fn shade(&mut self, frame: &mut Frame, gbuffer: &GBuffer) -> Option<wgpu::TextureView> {
        let occlusion = self.occlusion.as_mut().map(|occlusion| occlusion.record(frame, gbuffer));
        Some(self.shade.record(frame, gbuffer, occlusion.as_ref()))
    }
}
