// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lightmaps: texture coordinates for every triangle of a scene, and the points of its surfaces that texels stand for.
//!
//! All of it runs on the CPU, gives the same numbers on every machine, and knows triangles in the order in which the caller has them.

mod receivers;
mod unwrap;

use glam::{UVec2, Vec2};

pub use receivers::{ANY_PLACE, POINTS_PER_TEXEL, Receivers, SurfacePoint};
pub use unwrap::{LightmapError, LightmapSettings, unwrap};

/// A triangle that has no texels.
pub const NO_CHART: u32 = u32::MAX;

/// Texture coordinates of a lightmap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightmapUvs {
    /// Width and height \[texels\].
    pub size: UVec2,
    /// Of all charts \[texels/m\].
    pub texels_per_metre: f32,
    /// Of each triangle, its corners' places \[texels\], (0, 0) top left; zeros if it has no texels.
    pub corners: Vec<[Vec2; 3]>,
    /// Of each triangle, the number of its chart, or [`NO_CHART`].
    pub charts: Vec<u32>,
    /// Number of charts.
    pub n_charts: u32,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}

impl LightmapUvs {
    /// Triangles without texels: they are too thin for texture coordinates.
    pub fn n_without_chart(&self) -> usize {
        self.charts.iter().filter(|chart| **chart == NO_CHART).count()
    }
}
