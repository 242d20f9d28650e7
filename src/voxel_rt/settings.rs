//! What can be chosen about `voxel-rt`.

use super::levels::MAX_LEVELS;
use super::{VoxelRtError, WriteStrategy};

/// How often light is reflected before it is counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bounces {
    /// At most so many times before it reaches the surface that is seen; 0: no indirect light. Each
    /// costs a ray for each point of a face.
    UpTo(u32),
    /// Reflected light is reflected again, a bounce a frame, without end; for one ray.
    #[default]
    Unlimited,
}

/// Where the light comes from that the grid holds before it is reflected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// Each face draws points of its surface, and for each a light and a shadow ray: what stands in
    /// shadow is known to be dark, and no voxel can be hit more often than others.
    #[default]
    PerFace,
    /// Rays leave the lights, as in the source: a square of them each light without extent, and one for all
    /// emissive surfaces and the sky. Faces that none meets are dark.
    FromLights(RaysInjected),
    /// Rays leave the camera, and for each a light is drawn. What the camera does not see is dark.
    FromCamera(RaysInjected),
}

/// Rays of a frame that deposit light where they meet a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RaysInjected {
    /// n: n × n rays, 1 to 4096.
    pub n_rays: u32,
    /// How those come together that meet the same face.
    pub strategy: WriteStrategy,
}

impl Default for RaysInjected {
    /// 512 × 512 rays, as in the source's tables, averaged exactly.
    fn default() -> Self {
        Self { n_rays: 512, strategy: WriteStrategy::Exact }
    }
}

/// How pixels read the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// Trilinear over the cells that hold surfaces which look the pixel's way.
    #[default]
    Valid,
    /// Trilinear over all eight cells, empty ones counting as dark: the source's, for comparison.
    Trilinear,
    /// The mean of seven such lookups, one cell apart along each axis: the source's remedy for the
    /// dark streaks of the one before.
    SevenTap,
}

/// Nested grids: the coarsest holds the whole scene, the others stand around the camera, with cells half as large from one to
/// the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// One, where the scene is not much larger than what stands around the camera when the technique is made (16 times the median
    /// distance, [`GpuScene::surroundings`](crate::gpu_scene::GpuScene::surroundings)); else up to 4, the finest 8 times as
    /// wide as that distance. The coarsest may then have cells more than twice as large as the next.
    #[default]
    Auto,
    /// So many, 1 to 6.
    Nested(u32),
}

/// Settings of `voxel-rt`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoxelRtSettings {
    /// Cells along the longest side of the scene's box, and along each side of the levels within: 1 to
    /// 256.
    pub resolution: u32,
    /// A value for each of a voxel's six faces; else one a voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points drawn on each face in each frame, at least 1. Each costs a short ray, and where
    /// that finds a surface a shadow ray and a bounce.
    pub points_per_face: u32,
    /// Rays that a face remembers, at least 1: with more of them the light is smoother, and follows
    /// changes that nobody reports more slowly.
    pub max_rays: u32,
    /// Where light comes from.
    pub direct: DirectLight,
    /// How often light is reflected.
    pub bounces: Bounces,
    /// How pixels read the grid.
    pub lookup: Lookup,
    /// Stream of random numbers.
    pub seed: u32,
}

impl Default for VoxelRtSettings {
    fn default() -> Self {
        Self {
            resolution: 128,
            anisotropic: true,
            levels: Levels::Auto,
            points_per_face: 1,
            max_rays: 1024,
            direct: DirectLight::PerFace,
            bounces: Bounces::Unlimited,
            lookup: Lookup::Valid,
            seed: 0,
        }
    }
}

impl VoxelRtSettings {
    /// Fails where a setting is out of its range.
    pub(super) fn check(&self) -> Result<(), VoxelRtError> {
        let within = |name, value: u32, range: std::ops::RangeInclusive<u32>, possible| {
            if range.contains(&value) {
                return Ok(());
            }
            Err(VoxelRtError::Setting { name, value: value.to_string(), possible })
        };
        within("resolution", self.resolution, 1..=256, "1 to 256")?;
        if let Levels::Nested(n) = self.levels {
            within("levels", n, 1..=MAX_LEVELS, "1 to 6, or by the surroundings")?;
        }
        within("points_per_face", self.points_per_face, 1..=256, "1 to 256")?;
        if let Bounces::UpTo(n) = self.bounces {
            within("bounces", n, 0..=64, "0 to 64, or without end")?;
        }
        if let DirectLight::FromLights(rays) | DirectLight::FromCamera(rays) = self.direct {
            within("n_rays", rays.n_rays, 1..=4096, "1 to 4096")?;
        }
        within("max_rays", self.max_rays, 1..=65536, "1 to 65536")
    }
}
