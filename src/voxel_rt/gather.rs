//! The kernel `voxel_rt/gather`: renews the irradiance of one level's faces.

use super::cache::{CacheBuffers, LevelPass};
use crate::bindings::baseline::kernels::voxel_rt::gather as kernel;
use crate::bindings::shadow_map::kernels::voxel_rt::gather as mapped;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::compute_pipeline;
use crate::shadow::ShadowMaps;

pub use kernel::GatherInfo;

/// The compiled kernel with its uniforms and bindings.
#[derive(Debug)]
pub struct GatherPass {
    levels: LevelPass,
    field: wgpu::BindGroup,
    variant: &'static str,
}

impl GatherPass {
    /// Compiles the kernel in the scene's variant and binds the buffers.
    pub fn new(gpu: &Gpu, scene: &GpuScene, buffers: &CacheBuffers) -> Self {
        let (field_layout, field) = buffers.field(gpu, &buffers.reflected);
        Self::with_field(gpu, scene, buffers, scene.variant(), &field_layout, field)
    }

    /// As [`Self::new`], with shadow maps for lights that have them. The scene's rays must be software's.
    pub fn with_shadow_maps(
        gpu: &Gpu,
        scene: &GpuScene,
        buffers: &CacheBuffers,
        maps: &ShadowMaps,
    ) -> Self {
        let layout = mapped::WgpuBindGroup2::get_bind_group_layout(&gpu.device);
        let (shadows, shadow_textures, shadow_compare) = maps.parts();
        let entries = mapped::WgpuBindGroup2Entries::new(mapped::WgpuBindGroup2EntriesParams {
            levels: buffers.levels.as_entire_buffer_binding(),
            structure: buffers.structure.as_entire_buffer_binding(),
            face_light: buffers.reflected.as_entire_buffer_binding(),
            shadows,
            shadow_textures,
            shadow_compare,
        });
        let field = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel light and shadow maps"),
            layout: &layout,
            entries: &entries.into_array(),
        });
        Self::with_field(gpu, scene, buffers, "shadow_map", &layout, field)
    }

    fn with_field(
        gpu: &Gpu,
        scene: &GpuScene,
        buffers: &CacheBuffers,
        variant: &'static str,
        field_layout: &wgpu::BindGroupLayout,
        field: wgpu::BindGroup,
    ) -> Self {
        let device = &gpu.device;
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let label = "voxel_rt/gather";
        let layouts = [Some(scene.layout()), Some(&layout), Some(field_layout)];
        let pipeline = compute_pipeline(gpu, label, variant, &layouts);
        let group = |_, info: &wgpu::Buffer, counts: &wgpu::Buffer| {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                info: info.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
                lights: buffers.lights.as_entire_buffer_binding(),
            });
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(label),
                layout: &layout,
                entries: &entries.into_array(),
            })
        };
        let levels = LevelPass::new::<GatherInfo>(gpu, label, pipeline, &buffers.counts, group);
        Self { levels, field, variant: scene.variant() }
    }

    /// Renews level `info.level`.
    ///
    /// `arguments`, `offset`: where the workgroup counts for one invocation a record stand.
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernel was compiled for.
    pub fn record(
        &self,
        gpu: &Gpu,
        pass: &mut wgpu::ComputePass,
        scene: &GpuScene,
        info: &GatherInfo,
        arguments: (&wgpu::Buffer, u64),
    ) {
        assert_eq!(self.variant, scene.variant(), "the kernel was compiled for another variant");
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_bind_group(2, &self.field, &[]);
        self.levels.record(gpu, pass, info.level, info, arguments);
    }
}
