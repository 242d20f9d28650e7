// SPDX-License-Identifier: MIT OR Apache-2.0
//! Words behind the buffers that the library creates, which no kernel may change: a missing bounds check shows.

use crate::gpu::Gpu;
use crate::gpu::guards::{self, Guarded};

/// From here on, buffers that the library creates on this thread have words behind their end, which belong to their
/// bindings, so that the device's own bounds checks do not hide writes. [`assert_guards`] looks at them.
pub fn guard_buffers() {
    guards::start();
}

/// Fails if a guard of this thread's buffers has changed, after all submitted work (unless the host has cleared all of it). Forgets the buffers, and returns how many there were.
///
/// # Panics
/// If a word behind a buffer was written, or the device is lost. The message names the buffers and the first words.
pub fn assert_guards(gpu: &Gpu) -> usize {
    let guarded = guards::take();
    let mut written = Vec::new();
    for Guarded { label, buffer, size } in &guarded {
        let bytes = super::read_of(gpu, buffer);
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes[*size as usize..]);
        let is_cleared = words.iter().all(|&word| word == 0);
        let first = words.iter().position(|&word| word != guards::GUARD_WORD);
        if let Some(ix) = first.filter(|_| !is_cleared) {
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
