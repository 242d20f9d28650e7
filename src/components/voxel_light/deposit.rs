// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light by rays from lights or the camera: `voxel_light/inject`, `voxel_light/resolve`,
//! `voxel_light/deposit`.

use super::cache::CacheBuffers;
use super::settings::{DirectLight, RaysInjected};
use super::{
    Eye, InjectError, Injection, InjectionSource, VoxelInjector, VoxelIrradiance, VoxelLightError,
    WriteStrategy,
};
use crate::components::voxels::Voxelizer;
use crate::gpu::{ComputeKernel, Gpu, Recorder, Shaders};
use crate::seam::{LightPeak, SceneSeam};
use glam::Vec3;

pub use crate::bindings::kernels::voxel_light::deposit::DepositInfo;

/// The largest irradiance of the packed strategies, which have only 255 steps, is the one at this share of the scene's
/// diagonal.
const PACKED_NEAREST: f32 = 0.125;

/// The range of [`Injection::largest_irradiance`].
const MIN_LARGEST: f32 = 1e-18;
const MAX_LARGEST: f32 = 1e30;

/// The compiled kernels, and the injected light of each level.
#[derive(Debug)]
pub struct DepositPass {
    rays: RaysInjected,
    from_camera: bool,
    volumes: Vec<VoxelIrradiance>,
    injector: VoxelInjector,
    deposit: ComputeKernel,
}

impl DepositPass {
    /// Compiles the kernels; None if faces sample their direct light themselves.
    ///
    /// # Errors
    /// [`InjectError`]: a buffer is larger than the device can bind.
    pub(super) fn new<'a>(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        direct: DirectLight,
        levels: impl Iterator<Item = &'a Voxelizer>,
    ) -> Result<Option<Self>, InjectError> {
        let (rays, from_camera) = match direct {
            DirectLight::PerFace => return Ok(None),
            DirectLight::FromLights(rays) => (rays, false),
            DirectLight::FromCamera(rays) => (rays, true),
        };
        let volumes = levels
            .map(|of| VoxelIrradiance::new(gpu, *of.grid(), of.structure(), rays.strategy))
            .collect::<Result<Vec<_>, _>>()?;
        let injector = VoxelInjector::new(gpu, scene, rays.strategy);
        let deposit = ComputeKernel::new(gpu, &Shaders::default(), None, "voxel_light/deposit");
        Ok(Some(Self { rays, from_camera, volumes, injector, deposit }))
    }

    /// Moves a level's grid to this corner \[m\].
    pub(super) fn move_level(&mut self, level: usize, origin: Vec3) {
        self.volumes[level].move_to(origin);
    }

    /// Traces this frame's rays and deposits what they find.
    ///
    /// `seed`: a different one in each frame. `light_frames`: see `cache::add_deposit`.
    pub(super) fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
        buffers: &CacheBuffers,
        seed: u32,
        light_frames: u32,
    ) -> Result<(), VoxelLightError> {
        let facts = scene.facts();
        for volume in &self.volumes {
            let half_cell = 0.5 * volume.grid().cell;
            let nearest = match self.rays.strategy {
                WriteStrategy::Exact => half_cell,
                _ => half_cell.max(PACKED_NEAREST * facts.diagonal()),
            };
            let of = |source, peak: LightPeak| Injection {
                source,
                n_rays: self.rays.n_rays,
                seed,
                largest_irradiance: peak.at(nearest).clamp(MIN_LARGEST, MAX_LARGEST),
            };
            let mut injections = Vec::new();
            if self.from_camera {
                let camera = eye.camera.as_ref().ok_or(VoxelLightError::NoCamera)?;
                injections.push(of(InjectionSource::Camera(camera), facts.drawn_peak));
            } else {
                let punctual = (0..).zip(&facts.punctual_peaks);
                injections.extend(punctual.map(|(ix, &peak)| of(InjectionSource::Light(ix), peak)));
                injections.push(of(InjectionSource::Extended, facts.drawn_extended_peak));
            }
            self.injector.record(recorder, scene, volume, &injections)?;
        }
        let pass = &mut recorder.compute(self.deposit.name());
        for (level, volume) in (0..).zip(&self.volumes) {
            self.deposit
                .call(pass)
                .uniform("info", &DepositInfo { level, light_frames, reserved_a: 0, reserved_b: 0 })
                .with(buffers.of_level(level))
                .bind("means", volume.means())
                .dispatch(buffers.records(level));
        }
        Ok(())
    }

    /// The injected light of each level; its counters say what was left out.
    pub fn volumes(&self) -> &[VoxelIrradiance] {
        &self.volumes
    }
}
