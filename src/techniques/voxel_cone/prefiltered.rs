// SPDX-License-Identifier: MIT OR Apache-2.0
//! What cones see with [`Tracing::Prefiltered`](super::Tracing): the pyramid, and the passes that fill it.

use super::settings::VoxelConeSettings;
use crate::components::voxel_light::VoxelLight;
use crate::components::voxel_pyramid::{
    FaceWeights, FillInfo, FillPass, PeakPass, PrefilterPass, Pyramid,
};
use crate::components::voxels::{VoxelAttributes, VoxelGrid};
use crate::gpu::{Gpu, Recorder};
use crate::seam::SceneSeam;
use crate::techniques::TechniqueError;

/// Attributes of the voxels' surfaces, their light in ever coarser cells, and the passes.
#[derive(Debug)]
pub(super) struct Prefiltered {
    pub attributes: Vec<VoxelAttributes>,
    pub pyramid: Pyramid,
    peak: PeakPass,
    fill: FillPass,
    prefilter: PrefilterPass,
}

impl Prefiltered {
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        light: &VoxelLight,
        settings: &VoxelConeSettings,
    ) -> Result<Self, TechniqueError> {
        let attributes = light
            .voxelizers()
            .map(|voxelizer| VoxelAttributes::new(gpu, scene, voxelizer))
            .collect::<Result<Vec<_>, _>>()?;
        let grids: Vec<VoxelGrid> = light.voxelizers().map(|of| *of.grid()).collect();
        let squared = settings.face_weights == FaceWeights::Squared;
        let pyramid = Pyramid::new(gpu, &grids, settings.storage, squared)?;
        Ok(Self {
            peak: PeakPass::new(gpu),
            fill: FillPass::new(gpu, &pyramid),
            prefilter: PrefilterPass::new(gpu, &pyramid),
            attributes,
            pyramid,
        })
    }

    /// Records what follows from a new structure.
    pub fn follow(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        light: &VoxelLight,
    ) -> Result<(), TechniqueError> {
        let levels = self.attributes.iter().zip(light.voxelizers()).enumerate();
        for (ix, (attributes, voxelizer)) in levels.filter(|&(ix, _)| light.is_new(ix)) {
            attributes.record(recorder, scene, voxelizer)?;
            self.pyramid.move_level(recorder, ix, voxelizer.grid().origin);
        }
        Ok(())
    }

    /// Writes the light of faces into the pyramid.
    pub fn build(&self, recorder: &mut Recorder, light: &VoxelLight, settings: &VoxelConeSettings) {
        let info = FillInfo {
            level: 0,
            fills_gaps: u32::from(settings.fills_gaps),
            backs_hide: u32::from(settings.opaque_backs),
            reserved: 0,
        };
        self.peak.record(recorder, light, &self.pyramid);
        self.fill.record(recorder, &self.pyramid, light.buffers(), &self.attributes, info);
        self.prefilter.record(recorder, &self.pyramid);
    }
}
