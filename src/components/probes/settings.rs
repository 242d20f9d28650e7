// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of probes.

use crate::bindings::lucerna::fields::probes::Probes;
use crate::components::voxels::VoxelGrid;
use glam::Vec3;

/// How a surface point finds out which of the probes around it see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProbeVisibility {
    /// All count.
    None,
    /// Those that are farther away than what they see in that direction count less.
    #[default]
    Distances,
}

/// Settings of [`Probes`](super::Probes).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ProbeSettings {
    /// Cells along the longest side of the scene's box, including a margin of 1.5 cells on each side: 2 to 128.
    pub cells: u32,
    /// Paths that each probe follows, at least 1; rounded up to a multiple of
    /// [`PATHS_PER_UPDATE`](super::PATHS_PER_UPDATE).
    pub n_paths: u32,
    /// How often light is reflected before it reaches the surface that is seen, at least 1.
    pub n_bounces: u32,
    /// Which probes a point sees.
    pub visibility: ProbeVisibility,
    /// Whether probes behind the surface count less.
    pub wraps: bool,
    /// How far points are moved along their normal before distances are compared \[cells\], 0 to 1.
    pub normal_bias: f32,
    /// Probes that are seen with less than this chance hardly count, 0 to 0.99.
    pub bleeding: f32,
    /// λ of the window against ringing (`wgsl/sh/window.wgsl`, Laplacian), at least 0; 0: none.
    pub window: f32,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Default for ProbeSettings {
    fn default() -> Self {
        Self {
            cells: 32,
            n_paths: 256,
            n_bounces: 16,
            visibility: ProbeVisibility::default(),
            wraps: true,
            normal_bias: 0.25,
            bleeding: 0.6,
            window: 0.0,
            seed: 0,
        }
    }
}

/// Least standard deviation of distances \[cells\].
const LEAST_DEVIATION: f32 = 0.02;

impl ProbeSettings {
    /// What look-ups need to know.
    pub(super) fn field(&self, lattice: VoxelGrid) -> Probes {
        // 1/(1 + λ l²(l + 1)²)
        let factor = |l: f32| 1.0 / (1.0 + self.window * (l * (l + 1.0)).powi(2));
        Probes {
            lattice,
            window: Vec3::new(1.0, factor(1.0), factor(2.0)),
            uses_distances: u32::from(self.visibility == ProbeVisibility::Distances),
            normal_bias: self.normal_bias,
            wraps: u32::from(self.wraps),
            least_variance: LEAST_DEVIATION * LEAST_DEVIATION,
            bleeding: self.bleeding,
        }
    }
}
