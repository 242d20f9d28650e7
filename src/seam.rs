// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene seam from the host's side: what techniques take of a scene, whoever keeps it.
//!
//! A scene is its kernels' modules ([`Shaders`]), bind group 0 ([`SceneGroup`]), what the CPU knows of it
//! ([`SceneFacts`]), and what has changed ([`Revisions`]). [`GpuScene`](crate::gpu_scene::GpuScene) makes all of it from a
//! [`Scene`](crate::scene::Scene); a renderer with a scene of its own implements [`SceneSeam`].

use crate::bindings::lucerna::scene::data::Light;
use crate::gpu::{SceneGroup, Shaders};
use glam::Vec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// A scene, as techniques see it.
pub trait SceneSeam {
    /// Where kernels come from that ask this scene.
    fn shaders(&self) -> &Shaders;

    /// Bind group 0 of compute kernels.
    fn group(&self) -> &SceneGroup;

    /// Bind group 0 of vertex and fragment kernels; None: lucerna draws nothing of this scene, neither a G-buffer nor shadow
    /// maps.
    fn raster_group(&self) -> Option<&SceneGroup> {
        None
    }

    /// What the CPU knows of the scene.
    fn facts(&self) -> &SceneFacts;

    /// What has changed, and how often.
    fn revisions(&self) -> Revisions;

    /// How far away what stands around a point is; None where nobody can tell. Techniques choose how fine their grids are by
    /// it.
    fn surroundings(&self, _point: Vec3) -> Option<Surroundings> {
        None
    }

    /// The box \[m\] around what lies within a box (least and greatest corner); None where nothing does, or nobody can tell.
    fn bounds_within(&self, _min: Vec3, _max: Vec3) -> Option<(Vec3, Vec3)> {
        None
    }
}

/// What the CPU knows of a scene.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct SceneFacts {
    /// Least corner of the world-space box of all triangles \[m\].
    pub bounds_min: Vec3,
    /// Its greatest corner \[m\].
    pub bounds_max: Vec3,
    /// Triangles that rays can meet: `n_triangles` of `scene::triangles`.
    pub n_triangles: u32,
    /// Emissive triangles, and one for a sky that is not black: what rays can hit.
    pub n_extended_lights: u32,
    /// The largest component of a surface's emission \[W·sr⁻¹·m⁻²\]; 0 where nothing shines.
    pub brightest_emission: f32,
    /// Every surface reflects as Lambert.
    pub diffuse_only: bool,
    /// Lights without extent in the order of `scene::lights::punctual_light`.
    pub punctual_lights: Vec<PunctualLight>,
    /// The most that each of these sends anywhere.
    pub punctual_peaks: Vec<LightPeak>,
    /// The most that a light drawn among all gives, divided by the probability of drawing it: what
    /// kernels get from `scene::lights::sample_light`.
    pub drawn_peak: LightPeak,
    /// As [`Self::drawn_peak`], for a light drawn among emissive triangles and the sky.
    pub drawn_extended_peak: LightPeak,
}

impl SceneFacts {
    /// Lights that can be drawn: punctual, emissive triangles, sky.
    pub fn n_lights(&self) -> u32 {
        self.punctual_lights.len() as u32 + self.n_extended_lights
    }

    /// Diagonal of the box \[m\].
    pub fn diagonal(&self) -> f32 {
        (self.bounds_max - self.bounds_min).length()
    }
}

/// A light without extent, as kernels have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualLight {
    /// Shines to all sides.
    Point {
        /// \[m\]
        position: Vec3,
    },
    /// Shines into a cone.
    Spot {
        /// \[m\]
        position: Vec3,
        /// Unit length, along which it shines.
        direction: Vec3,
        /// Cosine of the angle to `direction` beyond which nothing is lit.
        cos_outer: f32,
    },
    /// Shines from infinitely far.
    Directional {
        /// Unit length, along which light travels.
        direction: Vec3,
    },
}

/// The most that a light sends anywhere: a bound on the irradiance of surfaces that stand no nearer to it
/// than some distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LightPeak {
    /// What falls off with the square of the distance \[W·sr⁻¹\].
    pub intensity: f32,
    /// What does not \[W·m⁻²\].
    pub irradiance: f32,
}

impl LightPeak {
    /// Of what falls off with the square of the distance \[W·sr⁻¹\], and of what does not \[W·m⁻²\].
    pub fn new(intensity: f32, irradiance: f32) -> Self {
        Self { intensity, irradiance }
    }

    /// The bound at a distance \[m\], in W·m⁻².
    pub fn at(self, distance: f32) -> f32 {
        self.intensity / (distance * distance) + self.irradiance
    }

    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { intensity: factor * self.intensity, irradiance: factor * self.irradiance }
    }

    pub(crate) fn max(self, other: Self) -> Self {
        Self {
            intensity: self.intensity.max(other.intensity),
            irradiance: self.irradiance.max(other.irradiance),
        }
    }
}

/// Distances to what can be seen from a point, in all directions \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surroundings {
    /// Half of the directions that meet something meet it nearer than this.
    pub median: f32,
    /// None of them meets anything farther away.
    pub farthest: f32,
}

/// Numbers that are others when something has changed. Techniques, shadow maps and accumulators compare them with those of
/// their last frame: nobody has to tell them. Two scenes have none in common, unless one says so.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Revisions {
    /// Any triangles: where they are, or which there are.
    pub geometry: u64,
    /// Triangles that belong to something that moves.
    pub moving: u64,
    /// Lights.
    pub lights: u64,
    /// Materials.
    pub materials: u64,
    /// The sky.
    pub sky: u64,
}

/// What has changed of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// Any triangles have moved, or there are others.
    Geometry,
    /// Triangles have moved that belong to something that moves.
    Moving,
    /// Lights.
    Lights,
    /// Materials.
    Materials,
    /// The sky.
    Sky,
}

impl Revisions {
    /// Those of a new scene: no other has the same.
    pub fn fresh() -> Self {
        let number = fresh_number();
        Self { geometry: number, moving: number, lights: number, materials: number, sky: number }
    }

    /// The same after a change.
    pub fn changed(self, change: Change) -> Self {
        let mut out = self;
        *match change {
            Change::Geometry => &mut out.geometry,
            Change::Moving => &mut out.moving,
            Change::Lights => &mut out.lights,
            Change::Materials => &mut out.materials,
            Change::Sky => &mut out.sky,
        } = fresh_number();
        out
    }
}

/// A number that was never returned before.
fn fresh_number() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed) + 1
}

/// A scene with revisions of one's own: to say of buffers that the caller has written what has changed in them, or of a
/// scene that was made anew that it follows another.
#[derive(Clone, Copy)]
pub struct Revised<'a> {
    /// The scene.
    pub scene: &'a dyn SceneSeam,
    /// What it shall have instead of its own.
    pub revisions: Revisions,
}

impl SceneSeam for Revised<'_> {
    fn shaders(&self) -> &Shaders {
        self.scene.shaders()
    }

    fn group(&self) -> &SceneGroup {
        self.scene.group()
    }

    fn raster_group(&self) -> Option<&SceneGroup> {
        self.scene.raster_group()
    }

    fn facts(&self) -> &SceneFacts {
        self.scene.facts()
    }

    fn revisions(&self) -> Revisions {
        self.revisions
    }

    fn surroundings(&self, point: Vec3) -> Option<Surroundings> {
        self.scene.surroundings(point)
    }

    fn bounds_within(&self, min: Vec3, max: Vec3) -> Option<(Vec3, Vec3)> {
        self.scene.bounds_within(min, max)
    }
}

/// A scene or a picture that is not what something was made for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// Kernels were compiled for another variant, or other modules of the seam.
    #[error(
        "compiled for a scene of the variant {expected}, and this one has {found} (or other modules)"
    )]
    Shaders {
        /// Of the scene it was made for.
        expected: crate::shader::Variant,
        /// Of the scene given.
        found: crate::shader::Variant,
    },
    /// Another number of triangles.
    #[error("made for a scene of {expected} triangles, and this one has {found}")]
    Triangles {
        /// Of the scene it was made for.
        expected: u32,
        /// Of the scene given.
        found: u32,
    },
    /// Lights that need more shadow maps than there are.
    #[error("made for lights that need {expected} shadow maps, and these need {found}")]
    Lights {
        /// Of the scene it was made for.
        expected: u32,
        /// Of the scene given.
        found: u32,
    },
    /// Textures or targets of different sizes.
    #[error("the {what} has {found} pixels, and the picture {expected}")]
    Size {
        /// What is of another size.
        what: &'static str,
        /// Size of the picture \[pixels\].
        expected: glam::UVec2,
        /// Its own.
        found: glam::UVec2,
    },
    /// The scene gives no bind group for vertex and fragment kernels.
    #[error("the scene gives nothing to rasterise: `raster_group` is None")]
    NoRaster,
}

/// Fails where kernels of `compiled` cannot ask this scene.
pub(crate) fn check_shaders(compiled: &Shaders, scene: &dyn SceneSeam) -> Result<(), Mismatch> {
    if compiled.same(scene.shaders()) {
        return Ok(());
    }
    let (expected, found) = (compiled.variant(), scene.shaders().variant());
    Err(Mismatch::Shaders { expected, found })
}

impl From<&Light> for PunctualLight {
    fn from(light: &Light) -> Self {
        use crate::bindings::lucerna::scene::data as wgsl;
        match light.kind {
            wgsl::LIGHT_DIRECTIONAL => Self::Directional { direction: light.direction },
            // clamp(cos·scale + offset) is 0 from here on.
            wgsl::LIGHT_SPOT => Self::Spot {
                position: light.position,
                direction: light.direction,
                cos_outer: (-light.spot_offset / light.spot_scale).clamp(-1.0, 1.0),
            },
            _ => Self::Point { position: light.position },
        }
    }
}
