// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of prefiltered voxels and of cones through them.

use crate::bindings::lucerna::cone::march::ConeSettings;

/// Where prefiltered voxels are stored and how they are filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PyramidStorage {
    /// In 3-D textures, filtered by the device.
    #[default]
    Textures,
    /// In storage buffers, filtered by the kernel: the same result, but slower, and no more voxels than fit into a
    /// binding.
    Buffers,
}

/// How a cone weights the face of each axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FaceWeights {
    /// By the magnitude of the direction's component: a wall hides what is behind it at any angle.
    #[default]
    Projected,
    /// By its square, as in the source: walls leak at a slant.
    Squared,
}

/// How cones are marched; see `wgsl/cone/march.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeStepping {
    /// Length of a step in widths of the cone, 0.05 to 4.
    pub step_scale: f32,
    /// Added to the mip, −4 to 4. (The mip is also limited by the height above the surface that the cone leaves. For
    /// the wide cones of the sets, this limit matters more than the bias down to about −1.)
    pub mip_bias: f32,
    /// Opacity at which a cone ends, 0.01 to 1.
    pub opacity_threshold: f32,
    /// Distance along the normal at which cones start \[cells\], 0 to 8.
    pub start_cells: f32,
}

impl Default for ConeStepping {
    /// Steps of half a width and a threshold of 0.95, as in the source. Cells of three quarters of the cone's width,
    /// because filtering spreads them (the source's bias of 0 finds half of what is smaller than the cone, −1 twice as
    /// much). A start at 1.5 cells.
    fn default() -> Self {
        Self { step_scale: 0.5, mip_bias: -0.4, opacity_threshold: 0.95, start_cells: 1.5 }
    }
}

impl From<ConeStepping> for ConeSettings {
    fn from(stepping: ConeStepping) -> Self {
        let ConeStepping { step_scale, mip_bias, opacity_threshold, start_cells } = stepping;
        Self { step_scale, mip_bias, opacity_threshold, start_cells }
    }
}
