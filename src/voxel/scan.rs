//! Exclusive prefix sums: the kernels `scan/blocks` and `scan/add`.

use super::ADVICE;
use crate::bindings::baseline::kernels::scan::{add, blocks};
use crate::gpu::{Gpu, GpuError};
use crate::pass::{compute_pipeline, dispatch, storage_buffer};
use wgpu::util::DeviceExt;

/// The compiled kernels.
#[derive(Clone, Debug)]
pub struct Scan {
    blocks: wgpu::ComputePipeline,
    add: wgpu::ComputePipeline,
    layout: wgpu::BindGroupLayout,
}

/// A buffer to scan, with the sums of its blocks, level by level.
#[derive(Clone, Debug)]
pub struct ScanPlan {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    n: u32,
    bind_group: wgpu::BindGroup,
}

impl Scan {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let layout = blocks::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        Self {
            blocks: compute_pipeline(gpu, "scan/blocks", "", &[None, Some(&layout)]),
            add: compute_pipeline(gpu, "scan/add", "", &[None, Some(&layout)]),
            layout,
        }
    }

    /// Prepares scanning the first `n` u32 of `numbers` (a storage buffer of at least as many).
    ///
    /// # Errors
    /// The sums of the blocks do not fit a binding.
    pub fn plan(&self, gpu: &Gpu, numbers: &wgpu::Buffer, n: u32) -> Result<ScanPlan, GpuError> {
        let mut levels = Vec::new();
        let mut numbers = numbers.clone();
        let mut n = n;
        loop {
            let n_blocks = n.div_ceil(blocks::BLOCK).max(1);
            let bytes = u64::from(n_blocks) * 4;
            let sums =
                storage_buffer(gpu, "scan sums", bytes, wgpu::BufferUsages::empty(), ADVICE)?;
            let info = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("scan"),
                contents: bytemuck::bytes_of(&blocks::ScanInfo { n, n_blocks }),
                usage: wgpu::BufferUsages::UNIFORM,
            });
            // Both kernels have the same bindings.
            let entries = blocks::WgpuBindGroup1Entries::new(blocks::WgpuBindGroup1EntriesParams {
                info: info.as_entire_buffer_binding(),
                numbers: numbers.as_entire_buffer_binding(),
                sums: sums.as_entire_buffer_binding(),
            });
            let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("scan"),
                layout: &self.layout,
                entries: &entries.into_array(),
            });
            levels.push(Level { n, bind_group });
            if n_blocks == 1 {
                return Ok(ScanPlan { levels });
            }
            numbers = sums;
            n = n_blocks;
        }
    }

    /// Replaces each number by the sum of those before it; sums stop at 2³² − 1.
    pub fn record(&self, pass: &mut wgpu::ComputePass, plan: &ScanPlan) {
        pass.set_pipeline(&self.blocks);
        for level in &plan.levels {
            pass.set_bind_group(1, &level.bind_group, &[]);
            dispatch(pass, level.n, blocks::BLOCK);
        }
        pass.set_pipeline(&self.add);
        for level in plan.levels.iter().rev().skip(1) {
            pass.set_bind_group(1, &level.bind_group, &[]);
            dispatch(pass, level.n, add::WORKGROUP);
        }
    }
}
