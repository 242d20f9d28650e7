// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much light that a technique gathers over frames is still on its way, found on the GPU.
//!
//! ```text
//! light ──convergence/sum──▶ sums of blocks, after 1, 2, 3, 4, 6, 8, 12, 16, … frames
//!                              └──convergence/compare──▶ light to come, from the changes since 1/4 and 1/2 of the frames
//! ```
//!
//! What is noise is told from what is light by its being different in two halves of a block.

use crate::bindings::kernels::convergence::compare::CompareInfo;
use crate::bindings::kernels::convergence::sum::{BLOCK, SumInfo};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, GpuError, Recorder, Shaders, storage_buffer};
use crate::report::Stat;

/// The stat's value while there is nothing to compare with.
pub const UNKNOWN: u32 = u32::MAX;

/// Light of which less than this share is on its way has settled.
pub const SETTLED: f32 = 0.005;

/// Contents of the buffer `change` while there is nothing to compare with.
const NOTHING_KNOWN: [u32; 3] = [UNKNOWN, UNKNOWN, 0];
/// Where in it the word is that tells whether light has settled.
const SETTLED_AT: u64 = 8;

/// Sums of light at a few times, and the compiled kernels.
#[derive(Debug)]
pub struct Convergence {
    sum: ComputeKernel,
    compare: ComputeKernel,
    parts: Vec<Part>,
    n_sums: u32,
    /// Two f32 for each block, at [`N_TIMES`] times.
    sums: wgpu::Buffer,
    /// `Change` of the kernel `convergence/compare`.
    change: wgpu::Buffer,
    /// Frames since the light began anew.
    n_frames: u32,
}

/// Values that are counted together.
#[derive(Clone, Copy, Debug)]
struct Part {
    first: u32,
    capacity: u32,
    first_sum: u32,
}

/// Times of which the sums are kept: each has twice as many frames as the second one before it.
const N_TIMES: u32 = 5;

impl Convergence {
    /// For light in one buffer in parts of this many values at most (`array<vec4<f32>>`, one part after the other).
    ///
    /// # Errors
    /// [`GpuError::TooLarge`]: the sums are larger than the device can bind.
    pub fn new(gpu: &Gpu, capacities: impl IntoIterator<Item = u32>) -> Result<Self, GpuError> {
        let (mut first, mut first_sum) = (0, 0);
        let mut parts = Vec::new();
        for capacity in capacities {
            parts.push(Part { first, capacity, first_sum });
            first += capacity;
            first_sum += capacity.div_ceil(BLOCK);
        }
        let copied = wgpu::BufferUsages::COPY_DST;
        let storage = |what, n: u32| {
            storage_buffer(gpu, what, 8 * u64::from(n), copied, "use a lower resolution")
        };
        let change = storage("change of light", 2)?;
        gpu.queue.write_buffer(&change, 0, bytemuck::bytes_of(&NOTHING_KNOWN));
        let kernel = |name| ComputeKernel::new(gpu, &Shaders::default(), None, name);
        Ok(Self {
            sum: kernel("convergence/sum"),
            compare: kernel("convergence/compare"),
            parts,
            n_sums: first_sum,
            sums: storage("sums of light", N_TIMES * first_sum)?,
            change,
            n_frames: 0,
        })
    }

    /// Forgets what the light was: it has begun anew, or its values stand in another order.
    pub fn restart(&mut self, recorder: &mut Recorder) {
        if self.n_frames > 0 {
            recorder.upload(&self.change, 0, bytemuck::bytes_of(&NOTHING_KNOWN));
        }
        self.n_frames = 0;
    }

    /// Call it once a frame. `light`: rgb and a weight for each value; `counts`: a uniform buffer for each part, whose third u32
    /// is its number of values.
    ///
    /// # Panics
    /// If there is not one buffer of counts for each part.
    pub fn record(
        &mut self,
        recorder: &mut Recorder,
        light: &wgpu::Buffer,
        counts: &[wgpu::Buffer],
    ) {
        assert_eq!(counts.len(), self.parts.len(), "one buffer of counts for each part");
        self.n_frames = self.n_frames.saturating_add(1);
        let Some(time) = time_of_frame(self.n_frames) else { return };
        let of = |time: u32| time % N_TIMES * self.n_sums;
        {
            let pass = &mut recorder.compute(self.sum.name());
            for (part, counts) in self.parts.iter().zip(counts) {
                let info = SumInfo {
                    first: part.first,
                    capacity: part.capacity,
                    first_sum: of(time) + part.first_sum,
                    reserved: 0,
                };
                self.sum
                    .call(pass)
                    .uniform("info", &info)
                    .bind("counts", counts)
                    .bind("light", light)
                    .bind("sums", &self.sums)
                    .dispatch(Dispatch::Rows(part.capacity.div_ceil(BLOCK)));
            }
        }
        let Some(quarter) = time.checked_sub(4).filter(|&quarter| quarter > 0) else { return };
        let info = CompareInfo {
            n_sums: self.n_sums,
            now: of(time),
            half: of(time - 2),
            quarter: of(quarter),
            settled_below: SETTLED,
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        self.compare
            .call(&mut recorder.compute(self.compare.name()))
            .uniform("info", &info)
            .bind("sums", &self.sums)
            .bind("change", &self.change)
            .dispatch(Dispatch::Rows(1));
    }

    /// How much light is still on its way at most (two standard deviations above the estimate), in parts per million of all; [`UNKNOWN`] in the first frames.
    pub fn to_come(&self) -> Stat {
        Stat::counted("light on its way", "ppm", &self.change, 0)
    }

    /// By how much the light has changed since half as many frames, in the same form.
    pub fn since_half(&self) -> Stat {
        Stat::counted("light changed since half as many frames", "ppm", &self.change, 4)
    }

    /// Copies to a buffer whether less than [`SETTLED`] of the light is on its way: a u32, 1 or 0.
    pub(super) fn copy_is_settled(&self, recorder: &mut Recorder, to: &wgpu::Buffer, at: u64) {
        recorder.encoder().copy_buffer_to_buffer(&self.change, SETTLED_AT, to, at, 4);
    }
}

/// The place of a number of frames in 1, 2, 3, 4, 6, 8, 12, 16, …; None if it is not one of them.
fn time_of_frame(n_frames: u32) -> Option<u32> {
    match n_frames {
        0 => None,
        1 => Some(0),
        n if n.is_power_of_two() => Some(2 * n.ilog2() - 1),
        n if n % 3 == 0 && (n / 3).is_power_of_two() => Some(2 * (n / 3).ilog2() + 2),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::{N_TIMES, time_of_frame};

    #[test]
    fn every_second_time_has_twice_the_frames() {
        let times: Vec<u32> = (0..200).filter(|&n| time_of_frame(n).is_some()).collect();
        assert_eq!(times[..9], [1, 2, 3, 4, 6, 8, 12, 16, 24]);
        for (ix, &n) in times.iter().enumerate() {
            assert_eq!(time_of_frame(n), Some(ix as u32));
        }
        for five in times[1..].windows(N_TIMES as usize) {
            assert_eq!((five[2], five[4]), (2 * five[0], 4 * five[0]));
        }
        assert_eq!(time_of_frame(1 << 31), Some(61));
        assert_eq!(time_of_frame(3 << 30), Some(62));
        assert_eq!(time_of_frame(u32::MAX), None);
    }
}
