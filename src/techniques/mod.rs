// SPDX-License-Identifier: MIT OR Apache-2.0
//! Techniques of global illumination. All compute the same quantity in the same units, so that any two can be compared.
//!
//! | technique | what |
//! |---|---|
//! | [`reference`](mod@reference) | unidirectional path tracer, the ground truth |
//! | [`voxel_rt`] | rays from voxels, looked up by pixels |
//! | [`voxel_cone`] | cones through prefiltered voxels |
//! | [`probe_volume`] | light probes in a sparse grid |
//! | `sparse_probes` (feature `bake`) | few probes, precomputed transport, a lightmap |

pub mod probe_volume;
pub mod reference;
#[cfg(feature = "bake")]
pub mod sparse_probes;
pub mod voxel_cone;
pub mod voxel_rt;

use crate::components::LightVisibility;
use crate::components::voxel_light::Eye;
use crate::frame::Pixels;
use crate::gpu::{Gpu, Recorder};
use crate::seam::SceneSeam;
use glam::Vec3;
use probe_volume::{ProbeVolume, ProbeVolumeSettings};
use voxel_cone::{VoxelCone, VoxelConeSettings};
use voxel_rt::{VoxelRt, VoxelRtSettings};

pub use crate::frame::{DebugView, Technique, TechniqueError};
pub use crate::report::{Notice, Stat, StatSource};
pub use crate::setting::{
    Setting, SettingChoice, SettingError, SettingKind, SettingValue, Settings,
};

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
            Ok(Box::new(VoxelRt::with_visibility(
                gpu,
                scene,
                Settings::from_texts(settings)?,
                visibility,
                eye,
            )?))
        },
    ),
    TechniqueEntry::new::<VoxelConeSettings>(
        "voxel-cone",
        "Voxel cone tracing",
        |gpu, scene, settings, visibility, eye| {
            Ok(Box::new(VoxelCone::with_visibility(
                gpu,
                scene,
                Settings::from_texts(settings)?,
                visibility,
                eye,
            )?))
        },
    ),
    TechniqueEntry::new::<ProbeVolumeSettings>(
        "probe-volume",
        "Light probes in a sparse grid",
        |gpu, scene, settings, _, _| {
            Ok(Box::new(ProbeVolume::new(gpu, scene, Settings::from_texts(settings)?)?))
        },
    ),
    #[cfg(feature = "bake")]
    TechniqueEntry::new::<sparse_probes::SparseProbesSettings>(
        "sparse-probes",
        "Sparse radiance probes with precomputed transport, for surfaces that stand still",
        |_, _, _, _, _| {
            Err(TechniqueError::Other(
                "sparse-probes needs a bake of the scene: make one with `blocking::bake_sparse_probes`, and use \
                 `SparseProbesTechnique::new`"
                    .into(),
            ))
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
