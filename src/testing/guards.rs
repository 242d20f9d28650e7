// SPDX-License-Identifier: MIT OR Apache-2.0
//! Words behind the buffers that the library creates, which no kernel may change: a missing bounds check shows.

use crate::gpu::Gpu;
use std::cell::RefCell;

/// Bytes behind a buffer. They belong to its bindings, so that the device's own bounds checks do not hide writes.
const GUARD: u64 = 4096;

/// A buffer with a guard.
struct Guarded {
    label: &'static str,
    buffer: wgpu::Buffer,
    /// Where the guard begins.
    size: u64,
}

thread_local! {
    /// None: buffers get no guards.
    static GUARDED: RefCell<Option<Vec<Guarded>>> = const { RefCell::new(None) };
}

/// From here on, buffers that the library creates on this thread have guards.
pub fn guard_buffers() {
    GUARDED.set(Some(Vec::new()));
}

/// A zeroed buffer, guarded if that is on.
pub(crate) fn buffer(
    gpu: &Gpu,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let is_on = GUARDED.with_borrow(Option::is_some);
    let (more, copied) = match is_on {
        true => (GUARD, wgpu::BufferUsages::COPY_SRC),
        false => (0, wgpu::BufferUsages::empty()),
    };
    let made = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size + more,
        usage: usage | copied,
        mapped_at_creation: false,
    });
    GUARDED.with_borrow_mut(|guarded| {
        if let Some(guarded) = guarded {
            guarded.push(Guarded { label, buffer: made.clone(), size });
        }
    });
    made
}

/// Fails if a guard of this thread's buffers is no longer zero, after all submitted work. Forgets the buffers, and returns how many there were.
///
/// # Panics
/// If a word behind a buffer was written, or the device is lost. The message names the buffers and the first words.
pub fn assert_guards(gpu: &Gpu) -> usize {
    let guarded = GUARDED.with_borrow_mut(|of| of.as_mut().map(std::mem::take)).unwrap_or_default();
    let mut written = Vec::new();
    for Guarded { label, buffer, size } in &guarded {
        let bytes = super::read_of(gpu, buffer);
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes[*size as usize..]);
        if let Some(ix) = words.iter().position(|&word| word != 0) {
            written.push(format!(
                "`{label}`, {size} bytes: word {ix} behind its end is {:#010x}",
                words[ix]
            ));
        }
    }
    assert!(
        written.is_empty(),
        "{} of {} buffers were written behind their end:\n{}",
        written.len(),
        guarded.len(),
        written.join("\n")
    );
    guarded.len()
}
