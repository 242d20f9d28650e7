//! The passes that trace, write and resolve.

use super::write::quantum;
use super::{InjectError, VoxelIrradiance, WriteStrategy};
use crate::bindings::baseline::kernels::voxel_rt::{inject as kernel, resolve};
use crate::bindings::baseline::lucerna::camera::primary_ray as wgsl_camera;
use crate::frame::View;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::modules::shader_module;
use bytemuck::Zeroable;

/// Where samples come from.
#[derive(Clone, Copy, Debug)]
pub enum InjectionSource<'a> {
    /// Rays of one point, spot or directional light, in the order of [`crate::scene::Scene::lights`].
    Light(u32),
    /// Rays of all emissive triangles and the sky; nothing where there is neither.
    Extended,
    /// Rays of a camera, with one shadow ray each to a light of any kind.
    Camera(&'a View),
    /// Samples that are there: a storage buffer of [`super::VoxelSample`], and how many; at most
    /// 65 535 · 1024. (Recording makes a bind group for the buffer; nothing else allocates.)
    Samples(&'a wgpu::Buffer, u32),
}

/// Rays to trace and how their samples are scaled.
#[derive(Clone, Copy, Debug)]
pub struct Injection<'a> {
    /// Where samples come from.
    pub source: InjectionSource<'a>,
    /// n: n × n rays are traced.
    pub n_rays: u32,
    /// Stream of random numbers.
    pub seed: u32,
    /// The largest irradiance that a sample may have \[W·m⁻²\]; larger ones are clamped and counted.
    /// Between 1e-18 and 1e30; that of lights is [`LightPeak`](crate::gpu_scene::LightPeak). With half a cell as the nearest distance,
    /// surfaces that face a point light are right to 1e-4 up to 450 cells away. [`WriteStrategy::Exact`] rounds it up to a power of two, and means
    /// are right to 1e-4 from 1.2e-6 of that on (absolutely, to 1.2e-10 of it); the packed
    /// strategies hold 255 steps of it.
    pub largest_irradiance: f32,
}

/// Uniforms of one injection.
#[derive(Debug)]
struct Slot {
    injection: wgpu::Buffer,
    resolution: wgpu::Buffer,
    inject_group: wgpu::BindGroup,
    resolve_group: wgpu::BindGroup,
}

/// The compiled kernels, bound to one volume.
#[derive(Debug)]
pub struct VoxelInjector {
    strategy: WriteStrategy,
    variant: &'static str,
    light: wgpu::ComputePipeline,
    extended: wgpu::ComputePipeline,
    camera: wgpu::ComputePipeline,
    samples: wgpu::ComputePipeline,
    samples_layout: wgpu::BindGroupLayout,
    resolve: wgpu::ComputePipeline,
    slots: Vec<Slot>,
    n_records: u32,
}

impl VoxelInjector {
    /// Compiles the kernels in the scene's [variant](GpuScene::variant) and the volume's strategy, and
    /// makes room for the settings of `max_injections` injections in one recording.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        volume: &VoxelIrradiance,
        max_injections: usize,
    ) -> Self {
        let device = &gpu.device;
        let inject_layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let samples_layout = kernel::WgpuBindGroup2::get_bind_group_layout(device);
        let resolve_layout = resolve::WgpuBindGroup1::get_bind_group_layout(device);
        let inject_module = shader_module(gpu, "voxel_rt/inject", scene.variant());
        let resolve_module = shader_module(gpu, "voxel_rt/resolve", "");
        let strategy = f64::from(volume.strategy.constant());
        let pipeline = |module, entry, groups: &[Option<&wgpu::BindGroupLayout>]| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry),
                layout: Some(&device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(entry),
                    bind_group_layouts: groups,
                    immediate_size: 0,
                })),
                module,
                entry_point: Some(entry),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants: &[("STRATEGY", strategy)],
                    ..Default::default()
                },
                cache: None,
            })
        };
        let traced = [Some(scene.layout()), Some(&inject_layout)];
        Self {
            strategy: volume.strategy,
            variant: scene.variant(),
            light: pipeline(&inject_module, kernel::ENTRY_INJECT_LIGHT, &traced),
            extended: pipeline(&inject_module, kernel::ENTRY_INJECT_EXTENDED, &traced),
            camera: pipeline(&inject_module, kernel::ENTRY_INJECT_CAMERA, &traced),
            samples: pipeline(
                &inject_module,
                kernel::ENTRY_INJECT_SAMPLES,
                &[None, Some(&inject_layout), Some(&samples_layout)],
            ),
            resolve: pipeline(&resolve_module, resolve::ENTRY_MAIN, &[None, Some(&resolve_layout)]),
            slots: (0..max_injections)
                .map(|_| Slot::new(gpu, volume, &inject_layout, &resolve_layout))
                .collect(),
            samples_layout,
            n_records: volume.grid.capacity * volume.grid.n_faces,
        }
    }

    /// Records the injections in one pass (none: the means stay). Afterwards the volume's means are the sums of theirs, and
    /// what they were before is gone. The settings are written when the queue is next
    /// submitted to: record no second time before that.
    ///
    /// `volume`: the one that the injector was made for.
    ///
    /// # Errors
    /// [`InjectError`]; nothing has been recorded then.
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernels were compiled for.
    pub fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        volume: &VoxelIrradiance,
        injections: &[Injection],
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) -> Result<(), InjectError> {
        assert_eq!(self.variant, scene.variant(), "the kernels were compiled for another variant");
        if self.strategy != volume.strategy {
            let (injector, volume) = (self.strategy, volume.strategy);
            return Err(InjectError::OtherStrategy { injector, volume });
        }
        if injections.len() > self.slots.len() {
            let (asked, capacity) = (injections.len(), self.slots.len());
            return Err(InjectError::TooManyInjections { asked, capacity });
        }
        for injection in injections {
            check(scene, injection)?;
        }
        for (ix, (injection, slot)) in injections.iter().zip(&self.slots).enumerate() {
            slot.write(gpu, injection, ix == 0)?;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt"),
            timestamp_writes: timestamps,
        });
        for (injection, slot) in injections.iter().zip(&self.slots) {
            self.dispatch(gpu, &mut pass, scene, injection, slot);
            let [group, ..] = resolve::compute::MAIN_WORKGROUP_SIZE;
            let groups = self.n_records.div_ceil(group);
            let width = groups.min(gpu.device.limits().max_compute_workgroups_per_dimension);
            pass.set_pipeline(&self.resolve);
            pass.set_bind_group(1, &slot.resolve_group, &[]);
            pass.dispatch_workgroups(width, groups.div_ceil(width), 1);
        }
        Ok(())
    }

    fn dispatch(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        scene: &GpuScene,
        injection: &Injection,
        slot: &Slot,
    ) {
        let tiles = injection.n_rays.div_ceil(kernel::WORKGROUP * kernel::RUN_SIDE);
        let pipeline = match injection.source {
            InjectionSource::Extended if scene.n_extended_lights() == 0 => return,
            InjectionSource::Light(_) => &self.light,
            InjectionSource::Extended => &self.extended,
            InjectionSource::Camera(_) => &self.camera,
            InjectionSource::Samples(buffer, n_samples) => {
                let samples = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel samples"),
                    layout: &self.samples_layout,
                    entries: &[wgpu::BindGroupEntry {
                        binding: 0,
                        resource: buffer.as_entire_binding(),
                    }],
                });
                pass.set_pipeline(&self.samples);
                pass.set_bind_group(1, &slot.inject_group, &[]);
                pass.set_bind_group(2, &samples, &[]);
                pass.dispatch_workgroups(n_samples.div_ceil(SAMPLES_PER_GROUP), 1, 1);
                return;
            }
        };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_bind_group(1, &slot.inject_group, &[]);
        pass.dispatch_workgroups(tiles, tiles, 1);
    }
}

/// Of `inject_samples`.
const SAMPLES_PER_GROUP: u32 = kernel::compute::INJECT_SAMPLES_WORKGROUP_SIZE[0] * kernel::RUN;

fn check(scene: &GpuScene, injection: &Injection) -> Result<(), InjectError> {
    quantum(injection.largest_irradiance)?;
    let samples = match injection.source {
        // As many as workgroups of one axis take.
        InjectionSource::Samples(_, n) if n.div_ceil(SAMPLES_PER_GROUP) <= 65_535 => u64::from(n),
        InjectionSource::Samples(_, n) => {
            return Err(InjectError::TooManySamples { samples: u64::from(n) });
        }
        _ => u64::from(injection.n_rays).pow(2),
    };
    if samples > u64::from(u32::MAX) {
        return Err(InjectError::TooManySamples { samples });
    }
    let n_punctual = scene.n_lights() - scene.n_extended_lights();
    match injection.source {
        InjectionSource::Light(light) if light >= n_punctual => {
            Err(InjectError::NoSuchLight { light, n_punctual })
        }
        _ => Ok(()),
    }
}

impl Slot {
    fn new(
        gpu: &Gpu,
        volume: &VoxelIrradiance,
        inject_layout: &wgpu::BindGroupLayout,
        resolve_layout: &wgpu::BindGroupLayout,
    ) -> Self {
        let uniform = |label, size: usize| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let injection = uniform("injection", size_of::<kernel::Injection>());
        let resolution = uniform("resolution", size_of::<resolve::Resolution>());
        let inject_entries =
            kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                grid: volume.grid_uniform.as_entire_buffer_binding(),
                injection: injection.as_entire_buffer_binding(),
                structure: volume.structure.as_entire_buffer_binding(),
                accumulators: volume.accumulators.as_entire_buffer_binding(),
            });
        let resolve_entries =
            resolve::WgpuBindGroup1Entries::new(resolve::WgpuBindGroup1EntriesParams {
                grid: volume.grid_uniform.as_entire_buffer_binding(),
                resolution: resolution.as_entire_buffer_binding(),
                structure: volume.structure.as_entire_buffer_binding(),
                accumulators: volume.accumulators.as_entire_buffer_binding(),
                means: volume.means.as_entire_buffer_binding(),
            });
        let inject_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel_rt/inject"),
            layout: inject_layout,
            entries: &inject_entries.into_array(),
        });
        let resolve_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel_rt/resolve"),
            layout: resolve_layout,
            entries: &resolve_entries.into_array(),
        });
        Self { injection, resolution, inject_group, resolve_group }
    }

    fn write(&self, gpu: &Gpu, injection: &Injection, first: bool) -> Result<(), InjectError> {
        let quantum = quantum(injection.largest_irradiance)?;
        let (camera, light, n_samples) = match injection.source {
            InjectionSource::Light(light) => (wgsl_camera::Camera::zeroed(), light, 0),
            InjectionSource::Extended => (wgsl_camera::Camera::zeroed(), 0, 0),
            InjectionSource::Camera(view) => (view.data().camera, 0, 0),
            InjectionSource::Samples(_, n) => (wgsl_camera::Camera::zeroed(), 0, n),
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
        let resolution = resolve::Resolution {
            quantum,
            largest: injection.largest_irradiance,
            first: u32::from(first),
            reserved: 0,
        };
        gpu.queue.write_buffer(&self.injection, 0, bytemuck::bytes_of(&settings));
        gpu.queue.write_buffer(&self.resolution, 0, bytemuck::bytes_of(&resolution));
        Ok(())
    }
}
