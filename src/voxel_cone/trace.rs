//! The kernel `voxel_cone/trace`: a list of cones.

use super::pyramid::Pyramid;
use super::settings::ConeStepping;
use crate::bindings::baseline::kernels::voxel_cone::trace as kernel;
use crate::gpu::Gpu;
use crate::pass::{compute_pipeline, dispatch};
use wgpu::util::DeviceExt;

pub use crate::bindings::baseline::lucerna::cone::march::Cone;
pub use crate::bindings::baseline::lucerna::fields::cone_trace::ConeResult;

/// The compiled kernel, bound to a pyramid.
#[derive(Debug)]
pub struct TracePass {
    pipeline: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
    pyramid: wgpu::BindGroup,
}

impl TracePass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu, pyramid: &Pyramid) -> Self {
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let (pyramid_layout, group) = pyramid.reading(gpu);
        let layouts = [None, Some(&layout), Some(&pyramid_layout)];
        let pipeline = compute_pipeline(gpu, "voxel_cone/trace", pyramid.variant(), &layouts);
        Self { pipeline, layout, pyramid: group }
    }

    /// Records `n` cones: `cones` is `array<Cone>`, `results` `array<ConeResult>`, both at least so long.
    ///
    /// `near` \[m\]: how far [`ConeResult`]'s `near_transmittance` counts.
    #[expect(clippy::too_many_arguments, reason = "a pass names everything that it reads")]
    pub fn record(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        cones: &wgpu::Buffer,
        results: &wgpu::Buffer,
        n: u32,
        stepping: ConeStepping,
        near: f32,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) {
        let info = kernel::TraceInfo {
            cones: stepping.into(),
            near,
            n_cones: n,
            reserved_a: 0,
            reserved_b: 0,
        };
        let info = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("voxel_cone/trace"),
            contents: bytemuck::bytes_of(&info),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
            info: info.as_entire_buffer_binding(),
            cones: cones.as_entire_buffer_binding(),
            results: results.as_entire_buffer_binding(),
        });
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel_cone/trace"),
            layout: &self.layout,
            entries: &entries.into_array(),
        });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_cone/trace"),
            timestamp_writes: timestamps,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &group, &[]);
        pass.set_bind_group(2, &self.pyramid, &[]);
        dispatch(&mut pass, n, kernel::WORKGROUP);
    }
}
