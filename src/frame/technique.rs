// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a frame asks of a technique.

use super::Pixels;
use crate::components::LightVisibility;
use crate::components::shadow_maps::ShadowError;
use crate::components::voxel_light::{Eye, InjectError, VoxelLightError};
use crate::components::voxel_pyramid::PyramidError;
use crate::components::voxels::VoxelError;
use crate::gpu::{GpuError, Recorder};
use crate::report::{Notice, Stat};
use crate::seam::{Mismatch, SceneSeam};
use crate::setting::{Setting, SettingError, SettingValue};

/// A real-time technique of indirect light.
///
/// A technique is made by a function of its own (`new(&Gpu, &dyn SceneSeam, Settings, …)`), and is built from
/// [components](crate::components). It can be a `Box<dyn Technique>`.
pub trait Technique {
    /// Its name on the command line and in tables: `voxel-rt`.
    fn name(&self) -> &'static str;

    /// Records bringing up to date what the technique keeps between frames: injects, gathers, bounces. Called
    /// once a frame, before pixels are shaded. It compares the scene's revisions itself: nobody tells it what has changed.
    ///
    /// # Errors
    /// The technique does not fit the scene any more. What was recorded until then does no harm.
    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
    ) -> Result<(), TechniqueError>;

    /// Whether there is any indirect light: else [`Self::shade`] need not be called.
    fn shades(&self) -> bool {
        true
    }

    /// Records indirect light of every pixel into `target`, a texture of the picture's size, `rgba32float` with
    /// `STORAGE_BINDING`. rgb: radiance that the surface reflects
    /// towards the camera \[W·sr⁻¹·m⁻²\] of light that was reflected at least once before; 0 where
    /// there is no surface; a: ambient occlusion ([`Channel::Openness`](crate::film::Channel::Openness)), 1 if it is not
    /// known.
    ///
    /// The surface as `scene::pixel::pixel_surface` returns it is what reflects: a white
    /// Lambertian where irradiance is asked for.
    ///
    /// # Errors
    /// The technique cannot go on.
    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError>;

    /// What else than its light can be seen of the technique.
    fn debug_views(&self) -> &'static [DebugView] {
        &[]
    }

    /// As [`Self::shade`], drawing a debug view by its name instead.
    ///
    /// # Errors
    /// [`TechniqueError::NoDebugView`]
    fn shade_debug_view(
        &mut self,
        _recorder: &mut Recorder,
        _pixels: &Pixels,
        _target: &wgpu::TextureView,
        name: &str,
    ) -> Result<(), TechniqueError> {
        Err(TechniqueError::NoDebugView(name.to_owned()))
    }

    /// Its settings as they are now, described.
    fn settings(&self) -> Vec<(Setting, SettingValue)>;

    /// What can be counted of it: records, bytes, what was rejected or found no room.
    fn stats(&self) -> Vec<Stat> {
        Vec::new()
    }

    /// What is worth saying about how it was laid out for the scene.
    fn notices(&self) -> Vec<Notice> {
        Vec::new()
    }

    /// What it keeps as an answer to how much of a light a point sees, for pixels to ask; None: it has none.
    fn visibility(&self) -> Option<LightVisibility> {
        None
    }
}

/// Something of a technique that can be looked at instead of its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DebugView {
    /// As [`Technique::shade_debug_view`] takes it.
    pub name: &'static str,
    /// What is to be seen.
    pub help: &'static str,
}

impl DebugView {
    /// A view of this name.
    pub const fn new(name: &'static str, help: &'static str) -> Self {
        Self { name, help }
    }
}

/// A technique could not be set up, or a frame not be recorded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TechniqueError {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scene is not what the technique was made for.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The light of voxels.
    #[error(transparent)]
    VoxelLight(VoxelLightError),
    /// Voxels.
    #[error(transparent)]
    Voxels(VoxelError),
    /// Prefiltered voxels.
    #[error(transparent)]
    Pyramid(PyramidError),
    /// Shadow maps.
    #[error(transparent)]
    Shadows(ShadowError),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// There is no such debug view.
    #[error("no debug view `{0}`")]
    NoDebugView(String),
    /// Something else, of a technique outside this crate.
    #[error(transparent)]
    Other(#[from] Box<dyn std::error::Error + Send + Sync>),
}

// What means the same is the same, wherever it was found.
impl From<VoxelLightError> for TechniqueError {
    fn from(error: VoxelLightError) -> Self {
        match error {
            VoxelLightError::Mismatch(error) => Self::Mismatch(error),
            VoxelLightError::Voxel(error) => error.into(),
            VoxelLightError::Gpu(error) => Self::Gpu(error),
            VoxelLightError::Inject(InjectError::Gpu(error)) => Self::Gpu(error),
            VoxelLightError::Setting { name, value, possible } => {
                Self::Setting(SettingError::new(name, value, possible))
            }
            other => Self::VoxelLight(other),
        }
    }
}

impl From<VoxelError> for TechniqueError {
    fn from(error: VoxelError) -> Self {
        match error {
            VoxelError::Mismatch(error) => Self::Mismatch(error),
            VoxelError::Gpu(error) => Self::Gpu(error),
            other => Self::Voxels(other),
        }
    }
}

impl From<PyramidError> for TechniqueError {
    fn from(error: PyramidError) -> Self {
        match error {
            PyramidError::Gpu(error) => Self::Gpu(error),
            other => Self::Pyramid(other),
        }
    }
}

impl From<ShadowError> for TechniqueError {
    fn from(error: ShadowError) -> Self {
        match error {
            ShadowError::Mismatch(error) => Self::Mismatch(error),
            other => Self::Shadows(other),
        }
    }
}
