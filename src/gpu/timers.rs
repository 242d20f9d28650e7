// SPDX-License-Identifier: MIT OR Apache-2.0
//! GPU timestamps of many passes, resolved once a frame.

use crate::gpu::Gpu;

/// Passes of a frame that are timed; further ones are not.
const MAX_PASSES: u32 = 128;

/// Times the passes of a frame by name.
#[derive(Debug)]
pub struct PassTimers {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    names: Vec<&'static str>,
    /// Nanoseconds a tick.
    period: f64,
}

impl PassTimers {
    /// None where the device has no timestamps.
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

    /// Forgets the passes so far: a frame begins.
    pub fn begin_frame(&mut self) {
        self.names.clear();
    }

    /// What the descriptor of a compute pass takes.
    pub fn compute(&mut self, name: &'static str) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let first = self.next(name)?;
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(first),
            end_of_pass_write_index: Some(first + 1),
        })
    }

    /// What the descriptor of a render pass takes.
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

    /// To be recorded after the frame's passes.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if !self.names.is_empty() {
            let n = 2 * self.names.len() as u32;
            encoder.resolve_query_set(&self.queries, 0..n, &self.resolved, 0);
        }
    }

    /// The frame's passes in order, several of one name where a pass dispatches in parts.
    pub fn names(&self) -> &[&'static str] {
        &self.names
    }

    /// Where [`Self::resolve`] writes: begin and end of each pass as u64 ticks; it has `COPY_SRC`.
    pub fn resolved(&self) -> &wgpu::Buffer {
        &self.resolved
    }

    /// Milliseconds of each pass from the bytes of [`Self::resolved`], by name in the order of
    /// their first pass; parts of one name added.
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
