// SPDX-License-Identifier: MIT OR Apache-2.0
//! Techniques of global illumination. All compute the same quantity in the same units, so that any two can be compared.
//!
//! | technique | what |
//! |---|---|
//! | [`reference`](mod@reference) | unidirectional path tracer, the ground truth |
//! | [`voxel_rt`] | rays from voxels, looked up by pixels |
//! | [`voxel_cone`] | cones through prefiltered voxels |

pub mod reference;
pub mod voxel_cone;
pub mod voxel_rt;

mod setting;

use crate::components::LightVisibility;
use crate::components::shadow_maps::ShadowError;
use crate::components::voxel_light::{Eye, InjectError, VoxelLightError};
use crate::components::voxel_pyramid::PyramidError;
use crate::components::voxels::VoxelError;
use crate::frame::Pixels;
use crate::gpu::{Gpu, GpuError, Recorder};
use crate::seam::{Mismatch, SceneSeam};
use glam::Vec3;
use voxel_cone::{VoxelCone, VoxelConeSettings};
use voxel_rt::{VoxelRt, VoxelRtSettings};

pub use setting::{Setting, SettingChoice, SettingError, SettingKind, SettingValue, Settings};

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

    /// Records the indirect light of every pixel into `target`, a texture of the picture's size, `rgba32float` with
    /// `STORAGE_BINDING`. rgb: the radiance that the surface reflects towards the camera \[W·sr⁻¹·m⁻²\], of light that
    /// was reflected at least once before; 0 where there is no surface. a: ambient occlusion
    /// ([`reference::Channel::Openness`]), 1 if it is not known.
    ///
    /// The reflecting surface is the one that `scene::pixel::pixel_surface` returns: a white Lambertian one if
    /// irradiance is requested.
    ///
    /// # Errors
    /// The technique cannot go on.
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

/// A remark about a technique and a scene, in one sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Notice {
    /// Whether light will be missing or wrong.
    pub is_warning: bool,
    /// The sentence, without a full stop.
    pub text: String,
}

impl Notice {
    /// A remark that is good to know.
    pub fn note(text: String) -> Self {
        Self { is_warning: false, text }
    }

    /// A warning: what will be wrong, and what to do about it.
    pub fn warning(text: String) -> Self {
        Self { is_warning: true, text }
    }
}

/// Makes a technique from settings as text. `visibility`: how it decides which lights are visible; the last argument:
/// the camera's position \[m\].
type Make = fn(
    &Gpu,
    &dyn SceneSeam,
    &[(&str, &str)],
    &LightVisibility,
    Vec3,
) -> Result<Box<dyn Technique>, TechniqueError>;

/// A technique that can be created by its name.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct TechniqueEntry {
    /// Its name: `voxel-rt`.
    pub name: &'static str,
    /// What it is, in one line.
    pub help: &'static str,
    /// Its settings.
    pub settings: &'static [Setting],
    /// Their default values.
    pub defaults: fn() -> Vec<SettingValue>,
    make: Make,
}

/// All techniques that render frames.
pub const TECHNIQUES: &[TechniqueEntry] = &[
    TechniqueEntry::new::<NoSettings>(
        "direct",
        "Only direct light: rasterised, with ray-traced shadows",
        |_, _, _, _, _| Ok(Box::new(NoIndirect)),
    ),
    TechniqueEntry::new::<VoxelRtSettings>(
        "voxel-rt",
        "Ray-traced voxel global illumination",
        |gpu, scene, settings, visibility, eye| {
            Ok(Box::new(VoxelRt::with_visibility(gpu, scene, read(settings)?, visibility, eye)?))
        },
    ),
    TechniqueEntry::new::<VoxelConeSettings>(
        "voxel-cone",
        "Voxel cone tracing",
        |gpu, scene, settings, visibility, eye| {
            Ok(Box::new(VoxelCone::with_visibility(gpu, scene, read(settings)?, visibility, eye)?))
        },
    ),
];

impl TechniqueEntry {
    /// A technique with settings of this kind.
    pub const fn new<S: Settings>(name: &'static str, help: &'static str, make: Make) -> Self {
        fn defaults<S: Settings>() -> Vec<SettingValue> {
            let settings = S::default();
            (0..S::LIST.len()).map(|ix| settings.get(ix)).collect()
        }
        Self { name, help, settings: S::LIST, defaults: defaults::<S>, make }
    }

    /// Makes the technique. `settings`: names and values of the settings that differ from the defaults.
    ///
    /// # Errors
    /// A setting is unknown or out of range, or the technique cannot be made for this scene and device.
    pub fn make(
        &self,
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: &[(&str, &str)],
        visibility: &LightVisibility,
        eye: Vec3,
    ) -> Result<Box<dyn Technique>, TechniqueError> {
        (self.make)(gpu, scene, settings, visibility, eye)
    }
}

/// Settings from names and values, set in the order of the list, because some depend on others before them.
fn read<S: Settings>(given: &[(&str, &str)]) -> Result<S, SettingError> {
    let mut settings = S::default();
    let place = |name: &str| S::LIST.iter().position(|setting| setting.name == name);
    let mut sorted = given.to_vec();
    sorted.sort_by_key(|(name, _)| place(name));
    for (name, value) in sorted {
        settings.set_by_name(name, value)?;
    }
    Ok(settings)
}

/// Settings of a technique that has none.
#[derive(Clone, Copy, Debug, Default)]
struct NoSettings;

impl Settings for NoSettings {
    const LIST: &'static [Setting] = &[];

    fn get(&self, _ix: usize) -> SettingValue {
        SettingValue::Switch(false)
    }

    fn set(&mut self, _ix: usize, _value: SettingValue) {}
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

/// A statistic of a technique.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Stat {
    /// What is counted.
    pub name: &'static str,
    /// Its unit: `bytes`, `faces`, …
    pub unit: &'static str,
    /// Where to read the number.
    pub source: StatSource,
    /// For a number that should be 0: what to do if it is not, because light is missing or wrong then.
    pub fault: Option<&'static str>,
}

/// Where to read a [`Stat`].
#[derive(Clone, Debug)]
pub enum StatSource {
    /// The CPU knows it.
    Known(u64),
    /// A u32 at this byte of a buffer with `COPY_SRC`.
    Buffer(wgpu::Buffer, u64),
}

impl Stat {
    /// A number that the CPU knows.
    pub fn known(name: &'static str, unit: &'static str, number: u64) -> Self {
        Self { name, unit, source: StatSource::Known(number), fault: None }
    }

    /// A u32 at this byte of a buffer with `COPY_SRC`.
    pub fn counted(name: &'static str, unit: &'static str, buffer: &wgpu::Buffer, at: u64) -> Self {
        Self { name, unit, source: StatSource::Buffer(buffer.clone(), at), fault: None }
    }

    /// Marks the number as one that should be 0, with advice on what to do if it is not.
    pub fn fault(mut self, advice: &'static str) -> Self {
        self.fault = Some(advice);
        self
    }
}

/// A technique could not be created, or a frame could not be recorded.
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

/// No indirect light, only direct light.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoIndirect;

impl Technique for NoIndirect {
    fn name(&self) -> &'static str {
        "direct"
    }

    fn update(
        &mut self,
        _recorder: &mut Recorder,
        _scene: &dyn SceneSeam,
        _eye: &Eye,
    ) -> Result<(), TechniqueError> {
        Ok(())
    }

    fn shades(&self) -> bool {
        false
    }

    fn shade(
        &mut self,
        _recorder: &mut Recorder,
        _pixels: &Pixels,
        _target: &wgpu::TextureView,
    ) -> Result<(), TechniqueError> {
        Ok(())
    }

    fn settings(&self) -> Vec<(Setting, SettingValue)> {
        Vec::new()
    }
}
