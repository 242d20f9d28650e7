// SPDX-License-Identifier: MIT OR Apache-2.0
//! The interface between a frame and a technique.

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

/// A real-time technique for indirect light.
///
/// Each technique has its own constructor (`new(&Gpu, &dyn SceneSeam, Settings, …)`), and is built from
/// [components](crate::components). The trait is object-safe: `Box<dyn Technique>` works.
pub trait Technique {
    /// Its name on the command line and in tables: `voxel-rt`.
    fn name(&self) -> &'static str;

    /// Records the update of what the technique keeps between frames: it injects, gathers, bounces. Call it once a
    /// frame, before pixels are shaded. It compares the scene's revisions itself, so no call is needed to report a
    /// change.
    ///
    /// # Errors
    /// The technique no longer fits the scene. What has been recorded so far does no harm.
    fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
    ) -> Result<(), TechniqueError>;

    /// Whether there is any indirect light. If not, [`Self::shade`] need not be called.
    fn shades(&self) -> bool {
        true
    }

    /// Whether [`Self::shade`] writes ambient occlusion. If not, it is 1 everywhere.
    fn finds_openness(&self) -> bool {
        false
    }

    /// Records the indirect light of every pixel into `target`, a texture of the picture's size, `rgba32float` with
    /// `STORAGE_BINDING`. rgb: the radiance that the surface reflects towards the camera \[W·sr⁻¹·m⁻²\], of light that
    /// was reflected at least once before; 0 where there is no surface. a: ambient occlusion
    /// ([`Channel::Openness`](crate::film::Channel::Openness)), 1 if it is not known.
    ///
    /// The reflecting surface is the one that `scene::pixel::pixel_surface` returns: a white Lambertian one if
    /// irradiance is requested.
    ///
    /// # Errors
    /// The technique cannot continue.
    fn shade(
        &mut self,
        recorder: &mut Recorder,
        pixels: &Pixels,
        target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError>;

    /// Views of the technique other than its light.
    fn debug_views(&self) -> &'static [DebugView] {
        &[]
    }

    /// As [`Self::shade`], but records the debug view of this name.
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

    /// Descriptions of its settings, with their current values.
    fn settings(&self) -> Vec<(Setting, SettingValue)>;

    /// Its statistics: records, bytes, what was rejected or did not fit.
    fn stats(&self) -> Vec<Stat> {
        Vec::new()
    }

    /// How much of its light is still on its way at most, in parts per million
    /// ([`Convergence`](crate::components::convergence::Convergence)), to be read back at leisure. None if it does not gather light
    /// over frames, or does not know.
    fn light_to_come(&self) -> Option<Stat> {
        None
    }

    /// What the user should know about how it fits the scene.
    fn notices(&self) -> Vec<Notice> {
        Vec::new()
    }

    /// How pixels can query, from the technique's own data, how much of a light a point sees; None if the technique has
    /// no such data.
    fn visibility(&self) -> Option<LightVisibility> {
        None
    }
}

/// A view of a technique's data, shown instead of its light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DebugView {
    /// As [`Technique::shade_debug_view`] takes it.
    pub name: &'static str,
    /// What it shows.
    pub help: &'static str,
}

impl DebugView {
    /// A view of this name.
    pub const fn new(name: &'static str, help: &'static str) -> Self {
        Self { name, help }
    }
}

/// A technique could not be created, or a frame could not be recorded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TechniqueError {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// The scene differs from the one that the technique was made for.
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

// Errors of the same meaning become the same variant, wherever they were found.
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
