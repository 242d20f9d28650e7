// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene seam from the host's side: what techniques need from a scene, no matter who owns it.
//!
//! A scene consists of the modules that kernels import ([`Shaders`]), bind group 0 ([`SceneGroup`]), facts that the CPU
//! knows ([`SceneFacts`]), and what has changed ([`Revisions`]). [`GpuScene`](crate::gpu_scene::GpuScene) makes all of
//! these from a [`Scene`](crate::scene::Scene); a renderer with its own scene implements [`SceneSeam`].

use crate::bindings::lucerna::scene::data::Light;
use crate::gpu::{SceneGroup, Shaders};
use glam::Vec3;
use std::sync::atomic::{AtomicU64, Ordering};

/// A scene, as techniques see it.
pub trait SceneSeam {
    /// The source of kernels that use this scene.
    fn shaders(&self) -> &Shaders;

    /// Bind group 0 of compute kernels.
    fn group(&self) -> &SceneGroup;

    /// Bind group 0 of vertex and fragment kernels; None: lucerna cannot rasterise this scene, so it has no G-buffer
    /// and no shadow maps.
    fn raster_group(&self) -> Option<&SceneGroup> {
        None
    }

    /// What the CPU knows about the scene.
    fn facts(&self) -> &SceneFacts;

    /// What has changed, and how often.
    fn revisions(&self) -> Revisions;

    /// How far away the surfaces around a point are; None if this is not known. Techniques choose the size of their
    /// cells by it.
    fn surroundings(&self, _point: Vec3) -> Option<Surroundings> {
        None
    }

    /// The bounds \[m\] of what lies within a box (least and greatest corner); None if nothing does, or this is not
    /// known.
    fn bounds_within(&self, _min: Vec3, _max: Vec3) -> Option<(Vec3, Vec3)> {
        None
    }
}

/// What the CPU knows about a scene.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct SceneFacts {
    /// Least corner of the world-space box of all triangles \[m\].
    pub bounds_min: Vec3,
    /// Its greatest corner \[m\].
    pub bounds_max: Vec3,
    /// Number of triangles that rays can hit: `n_triangles` of `scene::triangles`.
    pub n_triangles: u32,
    /// Number of lights that rays can hit: emissive triangles, plus one for a sky that is not black.
    pub n_extended_lights: u32,
    /// The largest component of any surface's emission \[W·sr⁻¹·m⁻²\]; 0 if no surface emits light.
    pub brightest_emission: f32,
    /// Whether every surface is Lambertian.
    pub diffuse_only: bool,
    /// Lights without extent, in the order of `scene::lights::punctual_light`.
    pub punctual_lights: Vec<PunctualLight>,
    /// The greatest irradiance that each of these causes.
    pub punctual_peaks: Vec<LightPeak>,
    /// The greatest irradiance from a light that is sampled among all, divided by the probability of sampling it: what
    /// kernels get from `scene::lights::sample_light`.
    pub drawn_peak: LightPeak,
    /// As [`Self::drawn_peak`], for a light that is sampled among emissive triangles and the sky.
    pub drawn_extended_peak: LightPeak,
}

impl SceneFacts {
    /// Number of lights that can be sampled: punctual lights, emissive triangles, the sky.
    pub fn n_lights(&self) -> u32 {
        self.punctual_lights.len() as u32 + self.n_extended_lights
    }

    /// Diagonal of the box \[m\].
    pub fn diagonal(&self) -> f32 {
        (self.bounds_max - self.bounds_min).length()
    }
}

/// A light without extent, as kernels see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualLight {
    /// Emits in all directions.
    Point {
        /// \[m\]
        position: Vec3,
    },
    /// Emits into a cone.
    Spot {
        /// \[m\]
        position: Vec3,
        /// Direction in which it emits, of unit length.
        direction: Vec3,
        /// Cosine of the angle to `direction` beyond which nothing is lit.
        cos_outer: f32,
    },
    /// Is infinitely far away.
    Directional {
        /// Direction in which the light travels, of unit length.
        direction: Vec3,
    },
}

/// The greatest irradiance that a light causes: a bound for surfaces that are no nearer to it than some distance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct LightPeak {
    /// The part that falls off with the square of the distance \[W·sr⁻¹\].
    pub intensity: f32,
    /// The part that does not \[W·m⁻²\].
    pub irradiance: f32,
}

impl LightPeak {
    /// From the part that falls off with the square of the distance \[W·sr⁻¹\], and the part that does not \[W·m⁻²\].
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
    /// Median distance, over the directions in which there is a surface.
    pub median: f32,
    /// Greatest distance.
    pub farthest: f32,
}

/// A mesh that does not move, where it is in the world: what is needed to make texture coordinates for it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StaticMesh {
    /// For messages.
    pub name: String,
    /// \[m\]
    pub positions: Vec<Vec3>,
    /// Texture coordinates of a lightmap, as many as `positions`; empty: there are none.
    pub second_uv: Vec<glam::Vec2>,
    /// Three vertices each; the front is where they run counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
}

/// In a list of which mesh's triangle each triangle of a scene is: none's, because it belongs to something that moves.
pub const NO_MESH: u32 = u32::MAX;

/// Numbers that change whenever something in the scene changes. Techniques, shadow maps and accumulators compare them
/// with the numbers of their last frame, so no call is needed to report a change. Two scenes have no number in common,
/// unless [`Revised`] gives one to both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Revisions {
    /// Any triangles: their positions, or the set of triangles.
    pub geometry: u64,
    /// Triangles of moving objects.
    pub moving: u64,
    /// Lights.
    pub lights: u64,
    /// Materials.
    pub materials: u64,
    /// The sky.
    pub sky: u64,
}

/// What has changed in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Change {
    /// Any triangles have moved, or the set of triangles is a different one.
    Geometry,
    /// Triangles of moving objects have moved.
    Moving,
    /// Lights.
    Lights,
    /// Materials.
    Materials,
    /// The sky.
    Sky,
}

impl Revisions {
    /// The revisions of a new scene, which differ from all others.
    pub fn fresh() -> Self {
        let number = fresh_number();
        Self { geometry: number, moving: number, lights: number, materials: number, sky: number }
    }

    /// The revisions after a change.
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

/// A scene with your own revisions. Use it to report what has changed in buffers that you wrote yourself, or to declare
/// a newly made scene the successor of another.
#[derive(Clone, Copy)]
pub struct Revised<'a> {
    /// The scene.
    pub scene: &'a dyn SceneSeam,
    /// The revisions that replace the scene's own.
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

/// A scene or a picture differs from the one that an object was made for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Mismatch {
    /// Kernels were compiled for another variant, or for other modules of the seam.
    #[error(
        "compiled for a scene of the variant {expected}, but this one has the variant {found} (or other modules)"
    )]
    Shaders {
        /// Of the scene it was made for.
        expected: crate::shader::Variant,
        /// Of the scene given.
        found: crate::shader::Variant,
    },
    /// Another number of triangles.
    #[error("made for a scene of {expected} triangles, but this one has {found}")]
    Triangles {
        /// Of the scene it was made for.
        expected: u32,
        /// Of the scene given.
        found: u32,
    },
    /// The lights need more shadow maps than there are.
    #[error("made for lights that need {expected} shadow maps, but these need {found}")]
    Lights {
        /// Of the scene it was made for.
        expected: u32,
        /// Of the scene given.
        found: u32,
    },
    /// Textures or targets of different sizes.
    #[error("the {what} has {found} pixels, but the picture has {expected}")]
    Size {
        /// Which texture or target has another size.
        what: &'static str,
        /// Size of the picture \[pixels\].
        expected: glam::UVec2,
        /// Its own.
        found: glam::UVec2,
    },
    /// Rows that a film's stripe does not have.
    #[error("the work's rows are outside the film's stripe")]
    Rows,
    /// The scene has no bind group for vertex and fragment kernels.
    #[error("the scene cannot be rasterised: its `raster_group` is None")]
    NoRaster,
}

/// Fails if kernels of `compiled` cannot use this scene.
///
/// # Errors
/// [`Mismatch::Shaders`]
pub fn check_shaders(compiled: &Shaders, scene: &dyn SceneSeam) -> Result<(), Mismatch> {
    if compiled.same(scene.shaders()) {
        return Ok(());
    }
    let (expected, found) = (compiled.variant(), scene.shaders().variant());
    Err(Mismatch::Shaders { expected, found })
}

impl PunctualLight {
    pub(crate) fn of_record(light: &Light) -> Self {
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
