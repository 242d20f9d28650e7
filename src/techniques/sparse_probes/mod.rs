// SPDX-License-Identifier: MIT OR Apache-2.0
//! `sparse-probes`: few probes, precomputed transport, a lightmap.
//!
//! Surfaces stand still, lights do as they like. The method is described in `docs/techniques/sparse-probes.md`.

mod settings;
mod shade;

use super::{DebugView, Notice, Setting, SettingValue, Settings, Stat, Technique, TechniqueError};
use crate::components::LightVisibility;
use crate::components::sparse_probes::{SparseBake, SparseProbes, SparseProbesError};
use crate::components::voxel_light::Eye;
use crate::frame::Pixels;
use crate::gpu::{Gpu, Recorder, SceneGroup};
use crate::seam::SceneSeam;
use shade::{ShadePass, Shown};

pub use settings::{BAKED, SparseProbesSettings};

/// The technique: a bake's lightmap, lit anew in each frame, that pixels look up.
#[derive(Debug)]
pub struct SparseProbesTechnique {
    settings: SparseProbesSettings,
    probes: SparseProbes,
    shade: ShadePass,
    scene: SceneGroup,
}

impl SparseProbesTechnique {
    /// Makes it of a bake; of `settings`, those of its use count. `order`, `visibility`: as in [`SparseProbes::new`].
    ///
    /// # Errors
    /// [`TechniqueError`]: a setting is out of range, or the bake does not fit.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        bake: &SparseBake,
        order: &[u32],
        mut settings: SparseProbesSettings,
        visibility: &LightVisibility,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        settings.bake = bake.plan.settings;
        let probes = SparseProbes::new(gpu, scene, bake, order, visibility, settings.look)?;
        let shade = ShadePass::new(gpu, scene.shaders(), scene.group());
        Ok(Self { settings, probes, shade, scene: scene.group().clone() })
    }

    /// The component that keeps its light.
    pub fn probes(&self) -> &SparseProbes {
        &self.probes
    }

    fn show(
        &self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
        shown: Shown,
    ) -> Result<(), TechniqueError> {
        pixels.check_target("target", target)?;
        self.shade.record(recorder, (&self.probes, &self.scene), pixels, shown, target);
        Ok(())
    }
}

impl Technique for SparseProbesTechnique {
    fn name(&self) -> &'static str {
        "sparse-probes"
    }

    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        _eye: &Eye,
    ) -> Result<(), TechniqueError> {
        self.scene = scene.group().clone();
        Ok(self.probes.update(recorder, scene)?)
    }

    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        self.show(recorder, pixels, target, Shown::Light)
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
        let shown = Shown::of_name(name);
        let shown = shown.ok_or_else(|| TechniqueError::NoDebugView(name.to_owned()))?;
        self.show(recorder, pixels, target, shown)
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        self.settings.described()
    }

    fn stats(&self) -> Vec<Stat> {
        self.probes.stats()
    }

    fn light_to_come(&self) -> Option<Stat> {
        Some(self.probes.to_come())
    }

    fn notices(&self) -> Vec<Notice> {
        self.probes.notices()
    }
}

impl From<SparseProbesError> for TechniqueError {
    fn from(error: SparseProbesError) -> Self {
        match error {
            SparseProbesError::Mismatch(error) => Self::Mismatch(error),
            SparseProbesError::Gpu(error) => Self::Gpu(error),
            other => Self::Other(Box::new(other)),
        }
    }
}
