// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of the light of voxels.

use super::levels::MAX_LEVELS;
use super::{VoxelLightError, WriteStrategy};
use crate::components::voxels::Resolution;

/// How often light is reflected before it is looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bounces {
    /// At most this many times before it reaches the visible surface; 0: no indirect light. Each bounce costs a ray per
    /// point of a face.
    UpTo(u32),
    /// Without limit: reflected light is reflected again, one bounce per frame, at the cost of one ray.
    #[default]
    Unlimited,
}

/// How direct light reaches the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// Each face samples points of its surface, and for each a light with a shadow ray: what is in shadow is known to
    /// be dark, and no voxel gets more samples than others.
    #[default]
    PerFace,
    /// Rays start at the lights, as in the source: a square of rays for each light without extent, and one for all
    /// emissive surfaces and the sky. Faces that no ray hits are dark.
    FromLights(RaysInjected),
    /// Rays start at the camera, and for each a light is sampled. What the camera does not see is dark.
    FromCamera(RaysInjected),
}

/// Rays of a frame that deposit light where they hit a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RaysInjected {
    /// n: n × n rays, 1 to 4096.
    pub n_rays: u32,
    /// How rays that hit the same face are combined.
    pub strategy: WriteStrategy,
}

impl Default for RaysInjected {
    /// 512 × 512 rays, as in the source's tables, averaged exactly.
    fn default() -> Self {
        Self { n_rays: 512, strategy: WriteStrategy::Exact }
    }
}

/// Nested grids: the coarsest holds the whole scene, the others are around the camera, each with cells half as large as
/// the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// One, if the scene is not much larger than what is around the camera when the technique is made (16 times the
    /// median distance, [`SceneSeam::surroundings`](crate::seam::SceneSeam::surroundings)); otherwise up to 4, the
    /// finest 8 times as wide as that distance. In that case the coarsest may have cells more than twice as large as
    /// the next.
    #[default]
    Auto,
    /// This number of grids, 1 to 6.
    Nested(u32),
}

/// Settings of [`VoxelLight`](super::VoxelLight).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VoxelLightSettings {
    /// Cells of the coarsest grid. Along each side, the inner levels have as many as that grid has along its longest, 1
    /// to 256.
    pub resolution: Resolution,
    /// Whether to store a value for each of a voxel's six faces; otherwise one per voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points sampled on each face in each frame, 1 to 256. Each costs a short ray and, if that hits a surface,
    /// a shadow ray and a bounce.
    pub points_per_face: u32,
    /// Rays that a face averages over, 1 to 65536. With more of them the light is smoother, but follows unreported
    /// changes more slowly.
    pub max_rays: u32,
    /// How direct light reaches the voxels.
    pub direct: DirectLight,
    /// How often light is reflected.
    pub bounces: Bounces,
    /// Whether rays from the faces gather reflected light. If not, the caller must update it: `indirect` and `feedback`
    /// of [`FaceLight`](super::FaceLight) stay as they are, and
    /// [`CacheBuffers::reflected`](super::CacheBuffers::reflected) is direct light plus feedback (only direct light if
    /// the number of bounces is limited).
    pub finds_reflected: bool,
    /// Whether faces get second records where a wall stands across what they see
    /// (`wgsl/components/voxel_light/sides.wgsl`). Not for a grid with one value per voxel.
    pub divides: bool,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Default for VoxelLightSettings {
    fn default() -> Self {
        Self {
            resolution: Resolution::Longest(128),
            anisotropic: true,
            levels: Levels::Auto,
            points_per_face: 1,
            max_rays: 1024,
            direct: DirectLight::PerFace,
            bounces: Bounces::Unlimited,
            finds_reflected: true,
            divides: true,
            seed: 0,
        }
    }
}

impl VoxelLightSettings {
    /// Cells along the longest side.
    pub(super) fn longest(&self) -> u32 {
        match self.resolution {
            Resolution::Longest(n) => n,
            Resolution::Size(size) => size.max_element(),
        }
    }

    /// Fails if a setting is out of range.
    pub(super) fn check(&self) -> Result<(), VoxelLightError> {
        let within = |name, value: u32, range: std::ops::RangeInclusive<u32>, possible| {
            if range.contains(&value) {
                return Ok(());
            }
            Err(VoxelLightError::Setting { name, value: value.to_string(), possible })
        };
        within("resolution", self.longest(), 1..=256, "1 to 256")?;
        if let Levels::Nested(n) = self.levels {
            within("levels", n, 1..=MAX_LEVELS, "1 to 6, or auto")?;
        }
        within("points_per_face", self.points_per_face, 1..=256, "1 to 256")?;
        if let Bounces::UpTo(n) = self.bounces {
            within("bounces", n, 0..=64, "0 to 64, or unlimited")?;
        }
        if let DirectLight::FromLights(rays) | DirectLight::FromCamera(rays) = self.direct {
            within("n_rays", rays.n_rays, 1..=4096, "1 to 4096")?;
        }
        within("max_rays", self.max_rays, 1..=65536, "1 to 65536")
    }
}
