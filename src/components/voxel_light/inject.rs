// SPDX-License-Identifier: MIT OR Apache-2.0
//! The passes that trace rays, write their samples, and resolve the means.

use super::write::quantum;
use super::{InjectError, VoxelIrradiance, WriteStrategy};
use crate::bindings::kernels::voxel_light::{inject as kernel, resolve};
use crate::bindings::lucerna::camera::primary_ray::Camera;
use crate::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Gpu, Recorder, Shaders};
use crate::seam::{SceneSeam, check_shaders};
use bytemuck::Zeroable;
use glam::{UVec2, UVec3};

/// Where samples come from.
#[derive(Clone, Copy, Debug)]
pub enum InjectionSource<'a> {
    /// Rays from one point, spot or directional light, by its index in [`crate::scene::Scene::lights`].
    Light(u32),
    /// Rays from all emissive triangles and the sky; nothing if there are neither.
    Extended,
    /// Rays from a camera, each with one shadow ray to a light of any kind.
    Camera(&'a Camera),
    /// Existing samples: a storage buffer of [`super::VoxelSample`], and their number, at most 65 535 · 1024.
    Samples(&'a wgpu::Buffer, u32),
}

/// Which rays to trace, and how their samples are scaled.
#[derive(Clone, Copy, Debug)]
pub struct Injection<'a> {
    /// Where samples come from.
    pub source: InjectionSource<'a>,
    /// n: n × n rays are traced.
    pub n_rays: u32,
    /// Seed of the random numbers.
    pub seed: u32,
    /// The largest irradiance that a sample may have \[W·m⁻²\]; larger ones are clamped and counted. Between 1e-18 and
    /// 1e30; for lights, [`LightPeak`](crate::seam::LightPeak) gives it. With half a cell as the nearest distance,
    /// surfaces that face a point light are accurate to 1e-4 up to 450 cells away. [`WriteStrategy::Exact`] rounds it
    /// up to a power of two; means above 1.2e-6 of that are accurate to 1e-4 (and all means to 1.2e-10 of it,
    /// absolutely). The packed strategies divide it into 255 steps.
    pub largest_irradiance: f32,
}

/// The compiled kernels for volumes of one strategy.
#[derive(Debug)]
pub struct VoxelInjector {
    strategy: WriteStrategy,
    shaders: Shaders,
    light: ComputeKernel,
    extended: ComputeKernel,
    camera: ComputeKernel,
    samples: ComputeKernel,
    resolve: ComputeKernel,
    /// Bound if an injection has no samples.
    no_samples: wgpu::Buffer,
}

impl VoxelInjector {
    /// Compiles the kernels for the scene's variant and a strategy.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, strategy: WriteStrategy) -> Self {
        let constants = [("STRATEGY", f64::from(strategy.constant()))];
        let kernel = |name, entry| {
            let (shaders, group) = (scene.shaders(), Some(scene.group()));
            ComputeKernel::with_entry(gpu, shaders, group, name, Some(entry), &constants)
        };
        Self {
            strategy,
            shaders: scene.shaders().clone(),
            light: kernel("voxel_light/inject", kernel::ENTRY_INJECT_LIGHT),
            extended: kernel("voxel_light/inject", kernel::ENTRY_INJECT_EXTENDED),
            camera: kernel("voxel_light/inject", kernel::ENTRY_INJECT_CAMERA),
            samples: kernel("voxel_light/inject", kernel::ENTRY_INJECT_SAMPLES),
            resolve: kernel("voxel_light/resolve", resolve::ENTRY_MAIN),
            no_samples: crate::gpu::buffer(gpu, "no samples", 16, wgpu::BufferUsages::STORAGE),
        }
    }

    /// Records the injections in one pass (if there are none, the means stay). Afterwards the volume's means are the
    /// sums of the injections' means; the former means are lost.
    ///
    /// # Errors
    /// [`InjectError`]; in that case nothing is recorded.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        volume: &VoxelIrradiance,
        injections: &[Injection],
    ) -> Result<(), InjectError> {
        check_shaders(&self.shaders, scene)?;
        if self.strategy != volume.strategy {
            let (injector, volume) = (self.strategy, volume.strategy);
            return Err(InjectError::OtherStrategy { injector, volume });
        }
        for injection in injections {
            check(scene, injection)?;
        }
        let n_records = volume.grid.capacity * volume.grid.n_faces;
        let [group, ..] = resolve::compute::MAIN_WORKGROUP_SIZE;
        let groups = n_records.div_ceil(group);
        let limit = recorder.gpu().device.limits().max_compute_workgroups_per_dimension;
        let width = groups.min(limit);
        let pass = &mut recorder.compute("voxel_light/inject");
        for (ix, injection) in injections.iter().enumerate() {
            self.inject(pass, scene, volume, injection)?;
            let resolution = resolve::Resolution {
                quantum: quantum(injection.largest_irradiance)?,
                largest: injection.largest_irradiance,
                first: u32::from(ix == 0),
                reserved: 0,
            };
            self.resolve
                .call(pass)
                .uniform("grid", &volume.grid)
                .uniform("resolution", &resolution)
                .bind("structure", &volume.structure)
                .bind("accumulators", &volume.accumulators)
                .bind("means", &volume.means)
                .dispatch(Dispatch::Groups(UVec3::new(width, groups.div_ceil(width), 1)));
        }
        Ok(())
    }

    fn inject(
        &self,
        pass: &mut ComputeRecorder,
        scene: &dyn SceneSeam,
        volume: &VoxelIrradiance,
        injection: &Injection,
    ) -> Result<(), InjectError> {
        // Each invocation traces a run of rays.
        let n_runs = injection.n_rays.div_ceil(kernel::RUN_SIDE);
        let rays = Dispatch::Area(UVec2::splat(n_runs));
        let (kernel, size, samples) = match injection.source {
            InjectionSource::Extended if scene.facts().n_extended_lights == 0 => return Ok(()),
            InjectionSource::Light(_) => (&self.light, rays, &self.no_samples),
            InjectionSource::Extended => (&self.extended, rays, &self.no_samples),
            InjectionSource::Camera(_) => (&self.camera, rays, &self.no_samples),
            InjectionSource::Samples(buffer, n) => {
                let groups = UVec3::new(n.div_ceil(SAMPLES_PER_GROUP), 1, 1);
                (&self.samples, Dispatch::Groups(groups), buffer)
            }
        };
        let quantum = quantum(injection.largest_irradiance)?;
        let (camera, light, n_samples) = match injection.source {
            InjectionSource::Light(light) => (Camera::zeroed(), light, 0),
            InjectionSource::Extended => (Camera::zeroed(), 0, 0),
            InjectionSource::Camera(camera) => (*camera, 0, 0),
            InjectionSource::Samples(_, n) => (Camera::zeroed(), 0, n),
        };
        let settings = kernel::Injection {
            camera,
            n_rays: injection.n_rays,
            seed: injection.seed,
            light,
            n_samples,
            quanta_per_unit: 1.0 / quantum,
            unorm_per_unit: 1.0 / injection.largest_irradiance,
            reserved_a: 0,
            reserved_b: 0,
        };
        kernel
            .call(pass)
            .scene(scene.group())
            .uniform("grid", &volume.grid)
            .uniform("injection", &settings)
            .bind("structure", &volume.structure)
            .bind("accumulators", &volume.accumulators)
            .bind("samples", samples)
            .dispatch(size);
        Ok(())
    }
}

/// Samples per workgroup of `inject_samples`.
const SAMPLES_PER_GROUP: u32 = kernel::compute::INJECT_SAMPLES_WORKGROUP_SIZE[0] * kernel::RUN;

fn check(scene: &dyn SceneSeam, injection: &Injection) -> Result<(), InjectError> {
    quantum(injection.largest_irradiance)?;
    let samples = match injection.source {
        // As many as fit into the workgroups of one axis.
        InjectionSource::Samples(_, n) if n.div_ceil(SAMPLES_PER_GROUP) <= 65_535 => u64::from(n),
        InjectionSource::Samples(_, n) => {
            return Err(InjectError::TooManySamples { samples: u64::from(n) });
        }
        _ => u64::from(injection.n_rays).pow(2),
    };
    if samples > u64::from(u32::MAX) {
        return Err(InjectError::TooManySamples { samples });
    }
    let n_punctual = scene.facts().punctual_lights.len() as u32;
    match injection.source {
        InjectionSource::Light(light) if light >= n_punctual => {
            Err(InjectError::NoSuchLight { light, n_punctual })
        }
        _ => Ok(()),
    }
}
