//! Direct light by rays from lights or the camera: `voxel_rt/inject`, `voxel_rt/resolve`,
//! `voxel_rt/deposit`.

use super::cache::{CacheBuffers, LevelPass};
use super::settings::{DirectLight, RaysInjected};
use super::{
    InjectError, Injection, InjectionSource, VoxelInjector, VoxelIrradiance, WriteStrategy,
};
use crate::bindings::baseline::kernels::voxel_rt::deposit as kernel;
use crate::frame::Frame;
use crate::gpu::Gpu;
use crate::gpu_scene::{GpuScene, LightPeak};
use crate::pass::compute_pipeline;
use crate::voxel::{RECORD_GROUPS_OFFSET, Voxelizer};
use glam::Vec3;

pub use kernel::DepositInfo;

/// The packed strategies hold the irradiance at this share of the scene's diagonal as their largest: they
/// have 255 steps alone.
const PACKED_NEAREST: f32 = 0.125;

/// What [`Injection::largest_irradiance`] may be.
const MIN_LARGEST: f32 = 1e-18;
const MAX_LARGEST: f32 = 1e30;

/// The compiled kernels, and of each level what was injected.
#[derive(Debug)]
pub struct DepositPass {
    rays: RaysInjected,
    from_camera: bool,
    volumes: Vec<VoxelIrradiance>,
    injectors: Vec<VoxelInjector>,
    deposit: LevelPass,
}

impl DepositPass {
    /// Compiles the kernels; None where faces find their direct light themselves.
    ///
    /// # Errors
    /// [`InjectError`]: a buffer is larger than the device binds.
    pub(super) fn new<'a>(
        gpu: &Gpu,
        scene: &GpuScene,
        buffers: &CacheBuffers,
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
        let n_sources = if from_camera { 1 } else { scene.punctual_peaks().len() + 1 };
        let injectors = volumes
            .iter()
            .map(|volume| VoxelInjector::new(gpu, scene, volume, n_sources))
            .collect();
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let label = "voxel_rt/deposit";
        let pipeline = compute_pipeline(gpu, label, "", &[None, Some(&layout)]);
        let group = |level: usize, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                levels: buffers.levels.as_entire_buffer_binding(),
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                means: volumes[level].means().as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
            });
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        let deposit = LevelPass::new::<DepositInfo>(gpu, label, pipeline, &buffers.counts, group);
        Ok(Some(Self { rays, from_camera, volumes, injectors, deposit }))
    }

    /// Moves a level's grid to this corner \[m\].
    pub(super) fn move_level(&mut self, gpu: &Gpu, level: usize, origin: Vec3) {
        self.volumes[level].move_to(gpu, origin);
    }

    /// Traces this frame's rays and deposits what they find. `voxelizers`: of the levels.
    ///
    /// `seed`: another one in each frame. `light_frames`: see `cache::add_deposit`.
    pub(super) fn record<'a>(
        &self,
        frame: &mut Frame,
        voxelizers: impl Iterator<Item = &'a Voxelizer>,
        seed: u32,
        light_frames: u32,
    ) -> Result<(), InjectError> {
        let (gpu, scene) = (frame.gpu, frame.scene);
        let (min, max) = scene.bounds();
        for (volume, injector) in self.volumes.iter().zip(&self.injectors) {
            let half_cell = 0.5 * volume.grid().cell;
            let nearest = match self.rays.strategy {
                WriteStrategy::Exact => half_cell,
                _ => half_cell.max(PACKED_NEAREST * (max - min).length()),
            };
            let of = |source, peak: LightPeak| Injection {
                source,
                n_rays: self.rays.n_rays,
                seed,
                largest_irradiance: peak.at(nearest).clamp(MIN_LARGEST, MAX_LARGEST),
            };
            let mut injections = Vec::new();
            if self.from_camera {
                injections.push(of(InjectionSource::Camera(frame.view), scene.drawn_peak()));
            } else {
                let punctual = (0..).zip(scene.punctual_peaks());
                injections.extend(punctual.map(|(ix, &peak)| of(InjectionSource::Light(ix), peak)));
                injections.push(of(InjectionSource::Extended, scene.drawn_extended_peak()));
            }
            let written = frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/inject"));
            injector.record(gpu, frame.encoder, scene, volume, &injections, written)?;
        }
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/deposit"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/deposit")),
        });
        for (level, voxelizer) in (0..).zip(voxelizers) {
            let info = DepositInfo { level, light_frames, reserved_a: 0, reserved_b: 0 };
            let arguments = (voxelizer.counts(), RECORD_GROUPS_OFFSET);
            self.deposit.record(gpu, &mut pass, level, &info, arguments);
        }
        Ok(())
    }

    /// What was injected, of each level; its counters say what had to be left out.
    pub fn volumes(&self) -> &[VoxelIrradiance] {
        &self.volumes
    }
}
