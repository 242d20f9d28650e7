// SPDX-License-Identifier: MIT OR Apache-2.0
//! GPU timestamps of many passes, resolved once a frame.

use crate::gpu::Gpu;

/// The most passes of a frame that are timed; further ones are not.
const MAX_PASSES: u32 = 128;

/// Times the passes of a frame by name.
#[derive(Debug)]
pub struct PassTimers {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    names: Vec<&'static str>,
    /// Nanoseconds per tick.
    period: f64,
}

impl PassTimers {
    /// None if the device has no timestamps.
    pub fn new(gpu: &Gpu) -> Option<Self> {
        gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass timers"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * MAX_PASSES,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass timers"),
                size: u64::from(2 * MAX_PASSES) * size_of::<u64>() as u64,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            names: Vec::with_capacity(MAX_PASSES as usize),
            period: f64::from(gpu.queue.get_timestamp_period()),
        })
    }

    /// Forgets the passes so far, at the start of a frame.
    pub fn begin_frame(&mut self) {
        self.names.clear();
    }

    /// Timestamp writes for the descriptor of a compute pass.
    pub fn compute(&mut self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = self.next(name)?;
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// Timestamp writes for the descriptor of a render pass.
    pub fn render(&mut self, name: &'static str) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        let first = self.next(name)?;
        Some(wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    fn next(&mut self, name: &'static str) -> Option<u32> {
        let ix = self.names.len() as u32;
        (ix < MAX_PASSES).then(|| {
            self.names.push(name);
            2 * ix
        })
    }

    /// Records the resolution of the timestamps. Call it after the frame's passes.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if !self.names.is_empty() {
            let n = 2 * self.names.len() as u32;
            encoder.resolve_query_set(&self.queries, 0..n, &self.resolved, 0);
        }
    }

    /// The names of the frame's passes in order; a pass that dispatches in parts occurs several
    /// times.
    pub fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// The buffer that [`Self::resolve`] writes: begin and end of each pass as u64 ticks. It has
    /// `COPY_SRC`.
    pub fn resolved(&self) -> &wgpu::Buffer {
        &self.resolved
    }

    /// Milliseconds of each pass from the bytes of [`Self::resolved`], by name, in the order in
    /// which names first occur; passes of the same name are added up.
    pub fn milliseconds(&self, bytes: &[u8]) -> Vec<(&'static str, f64)> {
        let ticks = |ix: usize| u64::from_ne_bytes(std::array::from_fn(|k| bytes[8 * ix + k]));
        let mut out: Vec<(&'static str, f64)> = Vec::new();
        for (ix, &name) in self.names.iter().enumerate() {
            let time = ticks(2 * ix + 1).saturating_sub(ticks(2 * ix)) as f64 * self.period * 1e-6;
            match out.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += time,
                None => out.push((name, time)),
            }
        }
        out
    }
}
