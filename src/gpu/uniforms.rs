// SPDX-License-Identifier: MIT OR Apache-2.0
//! Memory for the uniforms of a recording: each dispatch has its own place, so that one submission can contain any
//! number of dispatches.

use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of a buffer in which recordings get places.
const CHUNK: u64 = 64 << 10;

/// Buffers that no submission currently uses. Shared by all clones of a [`Gpu`](super::Gpu).
#[derive(Clone, Debug, Default)]
pub(super) struct UniformPool(Arc<Mutex<Vec<wgpu::Buffer>>>);

impl UniformPool {
    fn take(&self, device: &wgpu::Device) -> wgpu::Buffer {
        let free = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("uniforms of a recording"),
                size: CHUNK,
                usage: wgpu::BufferUsages::UNIFORM
                    | wgpu::BufferUsages::COPY_SRC
                    | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        })
    }

    /// Takes back buffers whose submission is done.
    fn give_back(&self, chunks: Vec<wgpu::Buffer>) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend(chunks);
    }
}

/// The places of one recording.
#[derive(Debug)]
pub(super) struct Uniforms {
    pool: UniformPool,
    chunks: Vec<wgpu::Buffer>,
    /// The offset from which the last chunk is free.
    next: u64,
    alignment: u64,
}

impl Uniforms {
    pub fn new(pool: &UniformPool, device: &wgpu::Device) -> Self {
        let alignment = u64::from(device.limits().min_uniform_buffer_offset_alignment);
        Self { pool: pool.clone(), chunks: Vec::new(), next: 0, alignment }
    }

    /// Writes `contents` (at most 64 KiB, whole words) to a place that nothing else in this recording or in an
    /// unfinished submission uses. The contents are written by the time the recording is submitted.
    pub fn place(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        contents: &[u8],
    ) -> (wgpu::Buffer, u32) {
        let bytes = contents.len() as u64;
        assert!(bytes <= CHUNK, "{bytes} bytes are too many for a uniform");
        if self.chunks.is_empty() || self.next + bytes > CHUNK {
            self.chunks.push(self.pool.take(device));
            self.next = 0;
        }
        let offset = self.next;
        self.next = (offset + bytes).next_multiple_of(self.alignment);
        let chunk = self.chunks.last().expect("one was pushed").clone();
        queue.write_buffer(&chunk, offset, contents);
        (chunk, offset as u32)
    }

    /// Returns the chunks once the recorded commands have run. (If the encoder is never submitted, they are dropped.)
    pub fn release(&mut self, encoder: &wgpu::CommandEncoder) {
        let chunks = std::mem::take(&mut self.chunks);
        if !chunks.is_empty() {
            let pool = self.pool.clone();
            encoder.on_submitted_work_done(move || pool.give_back(chunks));
        }
    }
}
