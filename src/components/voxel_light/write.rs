// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where samples are written: accumulators of one strategy, and their means.

use crate::bindings::lucerna::components::voxel_light::accumulator as wgsl;
use crate::bindings::lucerna::components::voxel_light::average::QUANTA_MAX;
use crate::components::voxels::{BRICK, VoxelGrid};
use crate::gpu::{Gpu, GpuError, storage_buffer};
use crate::seam::Mismatch;

/// How the samples of one record are combined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum WriteStrategy {
    /// The last writer wins, which is a race. 8 bits per channel.
    Store,
    /// Moving average of at most 255 samples by compare-and-swap, 8 bits per channel; depends on
    /// their order.
    MovingAverage,
    /// The largest packed word, 8 bits per channel; not an average, but repeatable.
    Max,
    /// The mean, from 64-bit integer sums: the same to the last bit in any order.
    #[default]
    Exact,
}

impl WriteStrategy {
    /// All four.
    pub const ALL: [Self; 4] = [Self::Store, Self::MovingAverage, Self::Max, Self::Exact];

    /// The kernels' `STRATEGY_…` constant.
    pub(super) fn constant(self) -> u32 {
        match self {
            Self::Store => wgsl::STRATEGY_STORE,
            Self::MovingAverage => wgsl::STRATEGY_MOVING_AVERAGE,
            Self::Max => wgsl::STRATEGY_MAX,
            Self::Exact => wgsl::STRATEGY_EXACT,
        }
    }

    /// 32-bit words of a record.
    pub fn words_per_record(self) -> u32 {
        if self == Self::Exact { wgsl::EXACT_WORDS } else { 1 }
    }
}

/// Voxel buffers could not be created, or light could not be injected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InjectError {
    /// A buffer is larger than the device can bind.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The grid is inconsistent, or does not match its structure.
    #[error("the voxel grid is not valid: {0}")]
    Grid(String),
    /// One injection could deposit more samples than a record can count.
    #[error("an injection of {samples} samples is too large; a record counts up to 4294967295")]
    TooManySamples {
        /// Requested samples.
        samples: u64,
    },
    /// There is no light of this index.
    #[error("there is no light {light}; the scene has {n_punctual} lights without extent")]
    NoSuchLight {
        /// Requested index.
        light: u32,
        /// Number of lights.
        n_punctual: u32,
    },
    /// The scene differs from the one that the injector was made for.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// Samples cannot be scaled with this largest value.
    #[error("the largest irradiance is {0} W/m²; it must be between 1e-18 and 1e30")]
    LargestValue(f32),
    /// The volume has another strategy than the one that the injector was compiled for.
    #[error("the injector's strategy is {injector:?}, but the volume's is {volume:?}")]
    OtherStrategy {
        /// The injector's strategy.
        injector: WriteStrategy,
        /// The volume's strategy.
        volume: WriteStrategy,
    },
}

/// Samples that were clamped or left out since the counters were cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RejectedSamples {
    /// NaN, infinite or negative: left out.
    pub not_finite: u32,
    /// Clamped to the largest value.
    pub clamped: u32,
    /// Outside the grid or in a voxel that is not occupied: left out.
    pub outside: u32,
    /// Rays that were not traced because the driver ended loops early.
    pub cut: u32,
}

impl RejectedSamples {
    /// Reads them from the first bytes of [`VoxelIrradiance::accumulators`].
    ///
    /// # Panics
    /// If there are fewer than 32 bytes.
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let word = |ix: u32| {
            let at = 4 * ix as usize;
            u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"))
        };
        Self {
            not_finite: word(wgsl::HEAD_REJECTED),
            clamped: word(wgsl::HEAD_CLAMPED),
            outside: word(wgsl::HEAD_OUTSIDE),
            cut: word(wgsl::HEAD_CUT),
        }
    }
}

/// Irradiance of the records of a sparse grid. A record is a face of an occupied voxel:
/// slot · n_faces + face.
#[derive(Debug)]
pub struct VoxelIrradiance {
    pub(super) grid: VoxelGrid,
    pub(super) strategy: WriteStrategy,
    pub(super) structure: wgpu::Buffer,
    pub(super) accumulators: wgpu::Buffer,
    pub(super) means: wgpu::Buffer,
}

impl VoxelIrradiance {
    /// Empty buffers for `grid.capacity` voxels.
    ///
    /// `structure`: (occupied bits, first slot) of each brick, then a cell of each slot, as
    /// `lucerna::components::voxels::bricks` says; a storage buffer that may be filled later.
    ///
    /// # Errors
    /// [`InjectError::Grid`]; [`GpuError::TooLarge`] if the accumulators (32 bytes per record with
    /// [`WriteStrategy::Exact`], otherwise 4) or the means (16) exceed the device's limit for one
    /// binding, 128 MiB in plain WebGPU.
    pub fn new(
        gpu: &Gpu,
        grid: VoxelGrid,
        structure: &wgpu::Buffer,
        strategy: WriteStrategy,
    ) -> Result<Self, InjectError> {
        check_grid(&grid, structure)?;
        let n_records = u64::from(grid.capacity) * u64::from(grid.n_faces);
        let words =
            u64::from(wgsl::HEAD_WORDS) + n_records * u64::from(strategy.words_per_record());
        let advice = "use larger cells, or one value per voxel";
        Ok(Self {
            grid,
            strategy,
            structure: structure.clone(),
            accumulators: storage_buffer(
                gpu,
                "the voxels' accumulators",
                4 * words,
                wgpu::BufferUsages::COPY_DST,
                advice,
            )?,
            means: storage_buffer(
                gpu,
                "the voxels' irradiance",
                16 * n_records,
                wgpu::BufferUsages::empty(),
                advice,
            )?,
        })
    }

    /// Moves the grid's minimum corner here \[m\].
    pub fn move_to(&mut self, origin: glam::Vec3) {
        self.grid.origin = origin;
    }

    /// The grid of the voxels.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// How samples are combined.
    pub fn strategy(&self) -> WriteStrategy {
        self.strategy
    }

    /// A `vec4<f32>` per record: irradiance \[W·m⁻²\], number of samples.
    pub fn means(&self) -> &wgpu::Buffer {
        &self.means
    }

    /// Counters ([`RejectedSamples`]) and accumulators; the accumulators are zero again after each
    /// injection.
    pub fn accumulators(&self) -> &wgpu::Buffer {
        &self.accumulators
    }

    /// Sets the counters of [`RejectedSamples`] to 0.
    pub fn clear_counters(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.clear_buffer(&self.accumulators, 0, Some(u64::from(4 * wgsl::HEAD_WORDS)));
    }
}

fn check_grid(grid: &VoxelGrid, structure: &wgpu::Buffer) -> Result<(), InjectError> {
    let wrong = |what: String| Err(InjectError::Grid(what));
    if !(grid.cell > 0.0 && grid.cell.is_finite() && grid.origin.is_finite()) {
        return wrong(format!("cells of {} m at {}", grid.cell, grid.origin));
    }
    if grid.size.min_element() < 1 || grid.size.max_element() > 1023 {
        return wrong(format!(
            "size {}, but only 1 to 1023 cells per axis are possible",
            grid.size
        ));
    }
    if ![1, 6].contains(&grid.n_faces) || grid.capacity == 0 {
        return wrong(format!("{} faces, room for {} voxels", grid.n_faces, grid.capacity));
    }
    if grid.bricks != (grid.size + BRICK - 1) / BRICK {
        return wrong(format!("{} bricks for {} cells", grid.bricks, grid.size));
    }
    let bytes = 8 * u64::from(grid.bricks.element_product());
    if structure.size() < bytes {
        return wrong(format!("its structure has {} bytes of {bytes}", structure.size()));
    }
    Ok(())
}

/// The value of one integer step with which samples up to `largest` fit, a power of two.
pub(super) fn quantum(largest: f32) -> Result<f32, InjectError> {
    if !(1e-18..=1e30).contains(&largest) {
        return Err(InjectError::LargestValue(largest));
    }
    let mut quantum = 2f64.powi((f64::from(largest) / f64::from(QUANTA_MAX)).log2().floor() as i32);
    while quantum * f64::from(QUANTA_MAX) < f64::from(largest) {
        quantum *= 2.0;
    }
    Ok(quantum as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_value_fits_and_no_smaller_step_would_do() {
        for largest in [1e-18, 0.1, 1.0, 4294967040.0, 4294967296.0, 3.7e9, 1e30f32] {
            let step = f64::from(quantum(largest).unwrap());
            assert_eq!(step.log2().fract(), 0.0);
            assert!(step * f64::from(QUANTA_MAX) >= f64::from(largest), "{largest}");
            assert!(0.5 * step * f64::from(QUANTA_MAX) < f64::from(largest), "{largest}");
            // Both it and its inverse are normal numbers.
            assert!((step as f32).is_normal() && (1.0 / step as f32).is_normal());
        }
        for largest in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-19] {
            assert!(matches!(quantum(largest), Err(InjectError::LargestValue(_))));
        }
    }
}
