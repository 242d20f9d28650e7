// SPDX-License-Identifier: MIT OR Apache-2.0
//! `probe-volume`: light probes in a sparse grid.
//!
//! Probes at the corners of the cells that surfaces meet gather light once, by paths, and pixels blend those around them. The method is
//! described in `docs/techniques/probe-volume.md`.

mod settings;
mod shade;

use super::{DebugView, Notice, Setting, SettingValue, Settings, Stat, Technique, TechniqueError};
use crate::components::probes::Probes;
use crate::components::voxel_light::Eye;
use crate::frame::Pixels;
use crate::gpu::{Gpu, Recorder};
use crate::seam::SceneSeam;
use shade::{ShadePass, Shown};

pub use settings::ProbeVolumeSettings;

/// The technique: probes, and pixels that look them up.
#[derive(Debug)]
pub struct ProbeVolume {
    settings: ProbeVolumeSettings,
    probes: Probes,
    shade: ShadePass,
}

impl ProbeVolume {
    /// Creates the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// # Errors
    /// [`TechniqueError`]: a setting is out of range, or a buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeVolumeSettings,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        let probes = Probes::new(gpu, scene, settings.0)?;
        Ok(Self::of(gpu, scene, settings, probes))
    }

    fn of(gpu: &Gpu, scene: &dyn SceneSeam, settings: ProbeVolumeSettings, probes: Probes) -> Self {
        let shade = ShadePass::new(gpu, scene.shaders(), Some(scene.group()), &probes);
        Self { settings, probes, shade }
    }

    /// As [`Self::new`], with probes at the points of a net ([`Probes::on_net`]).
    ///
    /// # Errors
    /// [`TechniqueError`]: as [`Self::new`].
    #[cfg(feature = "nets")]
    pub fn on_net(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeVolumeSettings,
        net: crate::components::probe_net::ProbeNet,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        let probes = Probes::on_net(gpu, scene, settings.0, net)?;
        Ok(Self::of(gpu, scene, settings, probes))
    }

    /// As [`Self::new`], with the light of bakes ([`Probes::from_bakes`]).
    ///
    /// # Errors
    /// [`TechniqueError`]: as [`Self::new`], or the bakes do not fit together.
    #[cfg(feature = "bake")]
    pub fn from_bakes(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeVolumeSettings,
        bakes: &[&crate::components::probes::ProbeBake],
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        let probes = Probes::from_bakes(gpu, scene, settings.0, bakes)?;
        let settings = ProbeVolumeSettings(*probes.settings());
        Ok(Self::of(gpu, scene, settings, probes))
    }

    /// As [`Self::new`], with the light of probes that stay in a file ([`Probes::from_file`]): those around a place are loaded by
    /// [`Probes::stream`].
    ///
    /// # Errors
    /// [`TechniqueError`]: as [`Self::new`], or there is too little room.
    #[cfg(feature = "bake")]
    pub fn from_file(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: ProbeVolumeSettings,
        file: &crate::components::probes::ProbeFile,
        most_bytes: u64,
    ) -> Result<Self, TechniqueError> {
        settings.check()?;
        let probes = Probes::from_file(gpu, scene, settings.0, file, most_bytes)?;
        let settings = ProbeVolumeSettings(*probes.settings());
        Ok(Self::of(gpu, scene, settings, probes))
    }

    /// The component that stores its light, to blend bakes and to stream.
    pub fn probes_mut(&mut self) -> &mut Probes {
        &mut self.probes
    }

    /// The component that stores its light.
    pub fn probes(&self) -> &Probes {
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
        self.shade.record(recorder, &self.probes, pixels, shown, target);
        Ok(())
    }
}

impl Technique for ProbeVolume {
    fn name(&self) -> &'static str {
        "probe-volume"
    }

    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        _eye: &Eye,
    ) -> Result<(), TechniqueError> {
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

    fn notices(&self) -> Vec<Notice> {
        self.probes.notices()
    }
}
