// SPDX-License-Identifier: MIT OR Apache-2.0
//! Exclusive prefix sums: the kernels `scan/blocks` and `scan/add`.

use super::ADVICE;
use crate::bindings::kernels::scan::blocks::{BLOCK, ScanInfo};
use crate::gpu::{
    ComputeKernel, ComputeRecorder, Dispatch, Gpu, GpuError, Shaders, storage_buffer,
};

/// The compiled kernels.
#[derive(Debug)]
pub struct Scan {
    blocks: ComputeKernel,
    add: ComputeKernel,
}

/// A buffer to scan, with the sums of its blocks, level by level.
#[derive(Clone, Debug)]
pub struct ScanPlan {
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    info: ScanInfo,
    numbers: wgpu::Buffer,
    sums: wgpu::Buffer,
}

impl Scan {
    /// Compiles the kernels.
    pub fn new(gpu: &Gpu) -> Self {
        let shaders = Shaders::default();
        let kernel = |name| ComputeKernel::new(gpu, &shaders, None, name);
        Self { blocks: kernel("scan/blocks"), add: kernel("scan/add") }
    }

    /// Prepares a scan of the first `n` u32 of `numbers`, a storage buffer of at least this many.
    ///
    /// # Errors
    /// The sums of the blocks do not fit a binding.
    pub fn plan(&self, gpu: &Gpu, numbers: &wgpu::Buffer, n: u32) -> Result<ScanPlan, GpuError> {
        let mut levels = Vec::new();
        let mut numbers = numbers.clone();
        let mut n = n;
        loop {
            let n_blocks = n.div_ceil(BLOCK).max(1);
            let bytes = u64::from(n_blocks) * 4;
            let sums =
                storage_buffer(gpu, "scan sums", bytes, wgpu::BufferUsages::empty(), ADVICE)?;
            let info = ScanInfo { n, n_blocks };
            levels.push(Level { info, numbers, sums: sums.clone() });
            if n_blocks == 1 {
                return Ok(ScanPlan { levels });
            }
            numbers = sums;
            n = n_blocks;
        }
    }

    /// Replaces each number with the sum of those before it; sums saturate at 2³² − 1.
    pub fn record(&self, pass: &mut ComputeRecorder, plan: &ScanPlan) {
        let call = |kernel: &ComputeKernel, pass: &mut ComputeRecorder, level: &Level, size| {
            kernel
                .call(pass)
                .uniform("info", &level.info)
                .bind("numbers", &level.numbers)
                .bind("sums", &level.sums)
                .dispatch(size);
        };
        for level in &plan.levels {
            call(&self.blocks, pass, level, Dispatch::Rows(level.info.n.div_ceil(BLOCK)));
        }
        for level in plan.levels.iter().rev().skip(1) {
            call(&self.add, pass, level, Dispatch::Items(level.info.n));
        }
    }
}
