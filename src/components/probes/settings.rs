// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of probes.

use crate::bindings::lucerna::fields::probe_store::{self, Probes};
use crate::components::voxels::VoxelGrid;
use crate::settings;
use crate::shader::{
    BASIS_AMBIENT_CUBE, BASIS_CHROMA_CONSTANT, BASIS_CHROMA_SH1, BASIS_SH1, BASIS_SH2_BYTES,
    BASIS_SH2_FLOAT, BASIS_SH4, Variant,
};
use bytemuck::Zeroable;
use glam::Vec4;

/// How a surface point finds out which of the probes around it see it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProbeVisibility {
    /// All count.
    None,
    /// Those that are farther away than what they see in that direction count less.
    #[default]
    Distances,
    /// Those of whose cell's subvolumes the point's one is hidden by surfaces that face away do not count: the masks of
    /// Light-probe volumes (2016). Neither bakes nor nets have them.
    Masks,
}

/// How a probe keeps its light (`wgsl/components/probes/basis.wgsl` and its variants).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProbeBasis {
    /// Spherical harmonics of order 2, as halfs.
    #[default]
    Sh2,
    /// The same as f32, as they are gathered.
    Sh2Float,
    /// The same; all but the constants are bytes.
    Sh2Bytes,
    /// Spherical harmonics of order 1, as halfs.
    Sh1,
    /// Irradiance along six axes, as halfs.
    AmbientCube,
    /// Luma of order 2 and two differences of colour of order 1, as halfs.
    ChromaSh1,
    /// Luma of order 2 and the means of two differences of colour, as halfs.
    ChromaConstant,
    /// Spherical harmonics of order 4 as halfs, without band 3, which adds nothing to irradiance. Paths are followed twice; bakes do not
    /// keep it.
    Sh4,
}

impl ProbeBasis {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Sh2,
        Self::Sh2Float,
        Self::Sh2Bytes,
        Self::Sh1,
        Self::AmbientCube,
        Self::ChromaSh1,
        Self::ChromaConstant,
        Self::Sh4,
    ];

    /// 4-byte words of a probe's light: `WORDS` of its module.
    pub fn words(self) -> u32 {
        match self {
            Self::Sh2 => 14,
            Self::Sh2Float => 27,
            Self::Sh2Bytes => 8,
            Self::Sh1 => 7,
            Self::AmbientCube => 10,
            Self::ChromaSh1 => 9,
            Self::ChromaConstant => 6,
            Self::Sh4 => 28,
        }
    }

    /// A variant with the modules of this basis.
    pub fn of(self, variant: Variant) -> Variant {
        match self {
            Self::Sh2 => variant,
            Self::Sh2Float => variant.with(BASIS_SH2_FLOAT),
            Self::Sh2Bytes => variant.with(BASIS_SH2_BYTES),
            Self::Sh1 => variant.with(BASIS_SH1),
            Self::AmbientCube => variant.with(BASIS_AMBIENT_CUBE),
            Self::ChromaSh1 => variant.with(BASIS_CHROMA_SH1),
            Self::ChromaConstant => variant.with(BASIS_CHROMA_CONSTANT),
            Self::Sh4 => variant.with(BASIS_SH4),
        }
    }

    /// How often paths are followed: nine coefficients each time.
    pub(super) fn n_parts(self) -> u32 {
        if self == Self::Sh4 { 2 } else { 1 }
    }
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
    /// A probe stops before, once the standard error of its mean light is at most this share of it, 0 to 1; 0: it never does.
    pub noise: f32,
    /// Cells with surfaces are divided (their edges are as `cells` says; before, twice that) only where light between probes is off by more than
    /// this share, 0 to 1; 0: all are.
    pub refine: f32,
    /// How probes keep their light.
    pub basis: ProbeBasis,
    /// Whether probes move away from surfaces that are very near.
    pub moves: bool,
    /// Which probes a point sees.
    pub visibility: ProbeVisibility,
    /// Whether probes behind the surface count less.
    pub wraps: bool,
    /// How far points are moved along their normal before distances are compared \[cells\], 0 to 1.
    pub normal_bias: f32,
    /// Probes that are seen with less than this chance hardly count, 0 to 0.99.
    pub bleeding: f32,
    /// Whether the roots of irradiances are blended between probes: light falls off convexly, and is too bright between probes that are blended as they
    /// are.
    pub roots: bool,
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
            noise: 0.0,
            refine: 0.0,
            basis: ProbeBasis::default(),
            moves: true,
            visibility: ProbeVisibility::default(),
            wraps: true,
            normal_bias: 0.35,
            bleeding: 0.6,
            roots: true,
            window: 0.0,
            seed: 0,
        }
    }
}

/// Least standard deviation of distances \[cells\].
const LEAST_DEVIATION: f32 = 0.02;

impl ProbeSettings {
    /// These settings of a bake, with another's settings of the look-up.
    #[cfg(feature = "bake")]
    pub(super) fn with_look_up(&self, of: &Self) -> Self {
        Self {
            cells: self.cells,
            n_paths: self.n_paths,
            n_bounces: self.n_bounces,
            noise: self.noise,
            refine: self.refine,
            moves: self.moves,
            seed: self.seed,
            ..*of
        }
    }

    /// What look-ups need to know.
    pub(super) fn field(&self, lattice: VoxelGrid) -> Probes {
        settings!(Probes {
            lattice,
            sight: match self.visibility {
                ProbeVisibility::None => 0,
                ProbeVisibility::Distances => probe_store::SIGHT_DISTANCES,
                ProbeVisibility::Masks => probe_store::SIGHT_MASKS,
            },
            normal_bias: self.normal_bias,
            wraps: u32::from(self.wraps),
            least_variance: LEAST_DEVIATION * LEAST_DEVIATION,
            bleeding: self.bleeding,
            roots: u32::from(self.roots),
            ..Zeroable::zeroed()
        })
    }

    /// Factors of the bands 0, 1, 2 and 4.
    pub(super) fn window_factors(&self) -> Vec4 {
        // 1/(1 + λ l²(l + 1)²)
        let factor = |l: f32| 1.0 / (1.0 + self.window * (l * (l + 1.0)).powi(2));
        Vec4::new(1.0, factor(1.0), factor(2.0), factor(4.0))
    }
}
