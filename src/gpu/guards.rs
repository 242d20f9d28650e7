// SPDX-License-Identifier: MIT OR Apache-2.0
//! Words behind buffers that no kernel may change (feature `testing`): `lucerna::testing::guard_buffers`.

use super::Gpu;
use std::cell::RefCell;

/// Bytes behind a buffer. They belong to its bindings, so that the device's own bounds checks do not hide writes.
const GUARD: u64 = 4096;
/// What they hold: no word that a kernel writes by chance, and not 0, which it may.
pub(crate) const GUARD_WORD: u32 = 0x6a4d_6a4d;

/// A buffer with a guard.
pub(crate) struct Guarded {
    pub label: &'static str,
    pub buffer: wgpu::Buffer,
    /// Where the guard begins.
    pub size: u64,
}

thread_local! {
    /// None: buffers get no guards.
    static GUARDED: RefCell<Option<Vec<Guarded>>> = const { RefCell::new(None) };
}

/// From here on, buffers that are made on this thread have guards.
pub(crate) fn start() {
    GUARDED.set(Some(Vec::new()));
}

/// The guarded buffers since the last call.
pub(crate) fn take() -> Vec<Guarded> {
    GUARDED.with_borrow_mut(|of| of.as_mut().map(std::mem::take)).unwrap_or_default()
}

/// A zeroed buffer, guarded if that is on. `size`: a multiple of 4 if so.
pub(super) fn buffer(
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
        mapped_at_creation: is_on,
    });
    if is_on {
        // (Mapping starts at a multiple of 8.)
        let start = size / wgpu::MAP_ALIGNMENT * wgpu::MAP_ALIGNMENT;
        let mut bytes = vec![0; (size - start) as usize];
        bytes.extend(GUARD_WORD.to_ne_bytes().repeat(GUARD as usize / 4));
        let mapped = made.slice(start..).get_mapped_range_mut();
        let mut guard = mapped.expect("a buffer that is made mapped");
        guard.copy_from_slice(&bytes);
        drop(guard);
        made.unmap();
    }
    GUARDED.with_borrow_mut(|guarded| {
        if let Some(guarded) = guarded {
            guarded.push(Guarded { label, buffer: made.clone(), size });
        }
    });
    made
}
