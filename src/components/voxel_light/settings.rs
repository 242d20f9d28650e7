// SPDX-License-Identifier: MIT OR Apache-2.0
//! What can be chosen about the light of voxels.

use super::levels::MAX_LEVELS;
use super::{VoxelLightError, WriteStrategy};
use crate::components::voxels::Resolution;

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

/// Nested grids: the coarsest holds the whole scene, the others stand around the camera, with cells half as large from one to
/// the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Levels {
    /// One, where the scene is not much larger than what stands around the camera when the technique is made (16 times the median
    /// distance, [`SceneSeam::surroundings`](crate::seam::SceneSeam::surroundings)); else up to 4, the finest 8 times as
    /// wide as that distance. The coarsest may then have cells more than twice as large as the next.
    #[default]
    Auto,
    /// So many, 1 to 6.
    Nested(u32),
}

/// Settings of [`VoxelLight`](super::VoxelLight).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VoxelLightSettings {
    /// Cells of the coarsest grid. The levels within have as many along each side as that has along its longest, 1 to 256.
    pub resolution: Resolution,
    /// A value for each of a voxel's six faces; else one a voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points drawn on each face in each frame, 1 to 256. Each costs a short ray, and where
    /// that finds a surface a shadow ray and a bounce.
    pub points_per_face: u32,
    /// Rays that a face remembers, 1 to 65536: with more of them the light is smoother, and follows
    /// changes that nobody reports more slowly.
    pub max_rays: u32,
    /// Where light comes from.
    pub direct: DirectLight,
    /// How often light is reflected.
    pub bounces: Bounces,
    /// Reflected light is found here, by rays from the faces. Else something else renews it: `indirect` and `feedback` of
    /// [`FaceLight`](super::FaceLight) stay as they are, and [`CacheBuffers::reflected`](super::CacheBuffers::reflected) is
    /// made of direct light and feedback (of direct light alone if bounces are counted).
    pub finds_reflected: bool,
    /// Stream of random numbers.
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

    /// Fails where a setting is out of its range.
    pub(super) fn check(&self) -> Result<(), VoxelLightError> {
        let within = |name, value: u32, range: std::ops::RangeInclusive<u32>, possible| {
            if range.contains(&value) {
                return Ok(());
            }
            Err(VoxelLightError::Setting { name, value: value.to_string(), possible })
        };
        within("resolution", self.longest(), 1..=256, "1 to 256")?;
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
