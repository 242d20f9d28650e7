//! Many rays at once against a scene: the kernels `rays/nearest_hit` and `rays/any_hit`.

use crate::bindings::baseline::kernels::rays::{any_hit, nearest_hit};
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::compute_pipeline;
use wgpu::util::DeviceExt;

pub use crate::bindings::host::rays::{Hit, Ray};
pub use crate::bindings::host::scene::NONE;
pub use any_hit::ANY_HIT_UNKNOWN;
pub use nearest_hit::NEAREST_HIT_UNKNOWN;

/// What is asked of each ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayQuestion {
    /// The nearest hit; answers are [`Hit`]s, `triangle` is [`NONE`] for a miss, and [`NEAREST_HIT_UNKNOWN`] where the driver
    /// ended the ray's loops early.
    Nearest,
    /// Whether anything is hit; answers are u32, 1 or 0, or [`ANY_HIT_UNKNOWN`].
    Any,
}

/// A compiled ray kernel.
#[derive(Clone, Debug)]
pub struct RayKernel {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    question: RayQuestion,
    variant: &'static str,
}

impl RayKernel {
    /// Compiles the kernel in the scene's [variant](GpuScene::variant); it serves every scene of the
    /// same variant.
    pub fn new(gpu: &Gpu, scene: &GpuScene, question: RayQuestion) -> Self {
        let device = &gpu.device;
        let (name, layout) = match question {
            RayQuestion::Nearest => {
                ("rays/nearest_hit", nearest_hit::WgpuBindGroup1::get_bind_group_layout(device))
            }
            RayQuestion::Any => {
                ("rays/any_hit", any_hit::WgpuBindGroup1::get_bind_group_layout(device))
            }
        };
        let layouts = [Some(scene.layout()), Some(&layout)];
        let pipeline = compute_pipeline(gpu, name, scene.variant(), &layouts);
        Self { pipeline, layout, question, variant: scene.variant() }
    }

    /// Records the rays in as many dispatches as WebGPU's limit on workgroups asks for.
    ///
    /// `rays`: `n_rays` [`Ray`]s; `answers`: as many [`Hit`]s or u32; both storage buffers.
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernel was compiled for.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        rays: &wgpu::Buffer,
        answers: &wgpu::Buffer,
        n_rays: u32,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) {
        assert_eq!(self.variant, scene.variant(), "the kernel was compiled for another variant");
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("rays"),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.bind_group(), &[]);
        let group = match self.question {
            RayQuestion::Nearest => nearest_hit::WORKGROUP,
            RayQuestion::Any => any_hit::WORKGROUP,
        };
        let per_dispatch = group * gpu.device.limits().max_compute_workgroups_per_dimension;
        for first in (0..n_rays).step_by(per_dispatch as usize) {
            // Both kernels have the same bindings.
            let batch = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("ray batch"),
                contents: bytemuck::bytes_of(&nearest_hit::BatchInfo { n_rays, first }),
                usage: wgpu::BufferUsages::UNIFORM,
            });
            let entries =
                nearest_hit::WgpuBindGroup1Entries::new(nearest_hit::WgpuBindGroup1EntriesParams {
                    batch: batch.as_entire_buffer_binding(),
                    rays: rays.as_entire_buffer_binding(),
                    hits: answers.as_entire_buffer_binding(),
                });
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("rays"),
                layout: &self.layout,
                entries: &entries.into_array(),
            });
            pass.set_bind_group(1, &bind_group, &[]);
            pass.dispatch_workgroups((n_rays - first).min(per_dispatch).div_ceil(group), 1, 1);
        }
    }
}
