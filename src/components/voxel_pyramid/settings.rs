// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can be chosen about prefiltered voxels and cones through them.

use crate::bindings::lucerna::cone::march::ConeSettings;

/// Where prefiltered voxels are kept and how they are filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PyramidStorage {
    /// In 3-D textures, filtered by the device.
    #[default]
    Textures,
    /// In storage buffers, filtered by the kernel: the same numbers, more slowly, and no more of them than
    /// a binding holds.
    Buffers,
}

/// How much each axis's face counts for a cone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FaceWeights {
    /// By the size of the direction's component: a wall hides what is behind it at any angle.
    #[default]
    Projected,
    /// By its square, as in the source: walls leak at a slant.
    Squared,
}

/// How cones are followed; see `wgsl/cone/march.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConeStepping {
    /// Step in widths of the cone, 0.05 to 4.
    pub step_scale: f32,
    /// Added to the mip, −4 to 4. (A mip is limited by the height over the surface that the cone leaves, too, and for the wide
    /// cones of the sets that decides down to about −1.)
    pub mip_bias: f32,
    /// At this opacity a cone is given up, 0.01 to 1.
    pub opacity_threshold: f32,
    /// Where cones begin, along the normal \[cells\], 0 to 8.
    pub start_cells: f32,
}

impl Default for ConeStepping {
    /// The source's half a width and 0.95; cells of three quarters of the cone's width, for filtering spreads them (the
    /// source's bias of 0 finds half of what is smaller than the cone, −1 twice as much); 1.5 cells.
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
