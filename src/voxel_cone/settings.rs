//! What can be chosen about `voxel-cone`.

use super::VoxelConeError;
use crate::bindings::baseline::lucerna::cone::march::ConeSettings;
use crate::voxel::Resolution;
use crate::voxel_rt::{Bounces, Levels};

/// Where prefiltered voxels are kept and how they are filtered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PyramidStorage {
    /// In 3-D textures, filtered by the device.
    #[default]
    Textures,
    /// In storage buffers, filtered by the kernel: the same numbers, more slowly, and no volume above
    /// what a binding holds.
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

/// Indirect light that glossy surfaces mirror.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Specular {
    /// None; what they would reflect is missing.
    Off,
    /// A direction drawn from the surface's lobe in each frame, with a cone of a third of the lobe's width.
    #[default]
    Roughness,
    /// One cone of this aperture \[degrees\], 0.1 to 119; the source's is 10.
    Fixed(f32),
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

/// Settings of `voxel-cone`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelConeSettings {
    /// Cells of the whole scene's grid, at most 256 along an axis. (Levels within have as many along
    /// each axis as that has along its longest.)
    pub resolution: Resolution,
    /// A value for each of a voxel's six faces; else one a voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points that find direct light on each face in each frame, 1 to 256.
    pub points_per_face: u32,
    /// How often light is reflected before it reaches the picture's surfaces and there once more. Counted,
    /// 1 to 64: every frame makes them all anew. Without end: each frame adds one.
    pub bounces: Bounces,
    /// Cones of a pixel: 5, 6, 9 or 16.
    pub n_cones: u32,
    /// Cones of a voxel's face: 5, 6, 9 or 16.
    pub n_bounce_cones: u32,
    /// Of bounces without end: a face's turn comes in one frame of so many, 1 to 64.
    pub bounce_period: u32,
    /// How cones are followed.
    pub stepping: ConeStepping,
    /// How faces are weighed.
    pub face_weights: FaceWeights,
    /// What glossy surfaces mirror.
    pub specular: Specular,
    /// Attenuate what is mirrored by what stands close by in the picture (screen-space specular occlusion).
    pub occludes_specular: bool,
    /// Attenuate diffuse light by what stands close by in the picture, at a quarter of its pixels.
    pub occludes_diffuse: bool,
    /// Cells without a surface that looks a face's way take the mean of two opposite neighbours beside it that have.
    pub fills_gaps: bool,
    /// Single-sided surfaces hide what is behind them from behind, too. Else cones pass through their backs,
    /// as glTF's `doubleSided` allows; then they do not darken what stands beside a wall.
    pub opaque_backs: bool,
    /// Where voxels are kept.
    pub storage: PyramidStorage,
    /// Stream of random numbers.
    pub seed: u32,
}

impl Default for VoxelConeSettings {
    fn default() -> Self {
        Self {
            resolution: Resolution::Longest(128),
            anisotropic: true,
            levels: Levels::Auto,
            points_per_face: 1,
            bounces: Bounces::Unlimited,
            n_cones: 9,
            n_bounce_cones: 9,
            bounce_period: 4,
            stepping: ConeStepping::default(),
            face_weights: FaceWeights::Projected,
            specular: Specular::Roughness,
            occludes_specular: true,
            occludes_diffuse: false,
            fills_gaps: false,
            opaque_backs: false,
            storage: PyramidStorage::Textures,
            seed: 0,
        }
    }
}

/// Numbers of cones that there are sets of.
const CONE_SETS: [u32; 4] = [5, 6, 9, 16];

impl VoxelConeSettings {
    /// Fails where a setting is out of its range. (Those of the voxels are checked with them.)
    pub(super) fn check(&self) -> Result<(), VoxelConeError> {
        let demand = |is_right: bool, name, value: String, possible| {
            if is_right { Ok(()) } else { Err(VoxelConeError::Setting { name, value, possible }) }
        };
        let set =
            |name, n: u32| demand(CONE_SETS.contains(&n), name, n.to_string(), "5, 6, 9 or 16");
        set("n_cones", self.n_cones)?;
        set("n_bounce_cones", self.n_bounce_cones)?;
        let within = |name, value: f32, range: std::ops::RangeInclusive<f32>, possible| {
            demand(range.contains(&value), name, value.to_string(), possible)
        };
        let ConeStepping { step_scale, mip_bias, opacity_threshold, start_cells } = self.stepping;
        within("step_scale", step_scale, 0.05..=4.0, "0.05 to 4")?;
        within("mip_bias", mip_bias, -4.0..=4.0, "-4 to 4")?;
        within("opacity_threshold", opacity_threshold, 0.01..=1.0, "0.01 to 1")?;
        within("start_cells", start_cells, 0.0..=8.0, "0 to 8")?;
        if let Specular::Fixed(degrees) = self.specular {
            within("specular aperture", degrees, 0.1..=119.0, "0.1 to 119 degrees")?;
        }
        let period = self.bounce_period;
        demand((1..=64).contains(&period), "bounce_period", period.to_string(), "1 to 64")?;
        let counted = self.bounces != Bounces::UpTo(0);
        demand(counted, "bounces", "0".into(), "1 to 64, or without end")
    }
}
