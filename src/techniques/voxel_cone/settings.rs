// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `voxel-cone`.

use crate::components::voxel_light::{Bounces, Levels, VoxelLightError, setting};
use crate::components::voxel_pyramid::{ConeStepping, FaceWeights, PyramidStorage};
use crate::components::voxels::{MAX_SIZE, Resolution};
use crate::techniques::{Setting, SettingChoice, SettingKind, SettingValue, Settings};

/// Indirect specular light of glossy surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Specular {
    /// None: the specular part of the reflection is missing.
    Off,
    /// A direction sampled from the surface's lobe in each frame, with a cone of a third of the lobe's width.
    #[default]
    Roughness,
    /// One cone of this aperture \[degrees\], 0.1 to 119; the source uses 10.
    Fixed(f32),
}

/// How cones find what they see.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tracing {
    /// Each cone is followed along its axis through the finest cells, from surface to surface: light does not leak through
    /// walls. Many cones, each in a direction of its own, integrate what a wide one would average.
    #[default]
    Surfels,
    /// Through cells as wide as the cone, which hold prefiltered light and opacity (the source's): little noise in a single
    /// frame, but light leaks, and some is lost.
    Prefiltered,
}

/// Settings of `voxel-cone`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VoxelConeSettings {
    /// Cells of the whole scene's grid, at most 256 along an axis. (Along each axis, the inner levels have as many
    /// cells as that grid has along its longest.)
    pub resolution: Resolution,
    /// Whether to store a value for each of a voxel's six faces; otherwise one per voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points per face and frame at which direct light is sampled, 1 to 256.
    pub points_per_face: u32,
    /// How often light is reflected before it reaches the surfaces in the picture, which reflect it once more. With a
    /// limit, 1 to 64: every frame computes all of them again. Unlimited: each frame adds one.
    pub bounces: Bounces,
    /// Cones per pixel: 5, 6, 9 or 16.
    pub n_cones: u32,
    /// Cones per face of a voxel: 5, 6, 9 or 16.
    pub n_bounce_cones: u32,
    /// For unlimited bounces: the number of frames over which the faces take turns, 1 to 64.
    pub bounce_period: u32,
    /// How cones find what they see. What only concerns prefiltered cells makes no difference otherwise: `stepping`,
    /// `face_weights`, both occlusions, `fills_gaps`, `opaque_backs`, `storage`.
    pub tracing: Tracing,
    /// How cones are marched.
    pub stepping: ConeStepping,
    /// How faces are weighted.
    pub face_weights: FaceWeights,
    /// Indirect specular light of glossy surfaces.
    pub specular: Specular,
    /// Attenuate specular light by surfaces that are close in the picture (screen-space specular occlusion).
    pub occludes_specular: bool,
    /// Attenuate diffuse light by surfaces that are close in the picture, computed for a quarter of its pixels.
    pub occludes_diffuse: bool,
    /// Cells without a surface that faces a face's direction take the mean of two opposite neighbours that have one.
    pub fills_gaps: bool,
    /// Single-sided surfaces also occlude from behind. Otherwise cones pass through their backs, as glTF's
    /// `doubleSided` allows; then they do not darken what is next to a wall.
    pub opaque_backs: bool,
    /// Where voxels are stored.
    pub storage: PyramidStorage,
    /// Seed of the random numbers.
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
            n_cones: 5,
            n_bounce_cones: 5,
            bounce_period: 4,
            tracing: Tracing::Surfels,
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

/// Numbers of cones for which there are sets.
const CONE_SETS: &[u32] = &[5, 6, 9, 16];

impl VoxelConeSettings {
    /// Fails if settings contradict each other.
    pub(super) fn check_tracing(&self) -> Result<(), VoxelLightError> {
        let wrong =
            |name, value: String, possible| Err(VoxelLightError::Setting { name, value, possible });
        match (self.tracing, self.specular) {
            (Tracing::Surfels, _) if !self.anisotropic => {
                wrong("anisotropic", "off".into(), "on, or off with tracing prefiltered")
            }
            (Tracing::Surfels, Specular::Fixed(degrees)) => {
                let possible = "roughness, off, or an aperture with tracing prefiltered";
                wrong("specular", degrees.to_string(), possible)
            }
            _ => Ok(()),
        }
    }

    /// Names of the settings that are not the default and make no difference.
    pub(super) fn idle(&self) -> Vec<&'static str> {
        if self.tracing == Tracing::Prefiltered {
            return Vec::new();
        }
        let of_prefiltered = |setting: &Setting| OF_PREFILTERED.contains(&setting.name);
        let (own, usual) = (self.described(), Self::default().described());
        let pairs = own.iter().zip(&usual).filter(|(own, usual)| own.1 != usual.1);
        pairs.map(|(own, _)| &own.0).filter(|&of| of_prefiltered(of)).map(|of| of.name).collect()
    }
}

/// Settings that concern only [`Tracing::Prefiltered`].
const OF_PREFILTERED: &[&str] = &[
    "step-scale",
    "mip-bias",
    "opacity-threshold",
    "start",
    "face-weights",
    "specular-occlusion",
    "diffuse-occlusion",
    "fill-gaps",
    "opaque-backs",
    "volumes",
];

const TRACING: &[SettingChoice] = &[
    SettingChoice::new(
        "surfels",
        "along its axis from surface to surface, through the finest cells",
    ),
    SettingChoice::new(
        "prefiltered",
        "through prefiltered cells as wide as itself (as in the source)",
    ),
];
const FACE_WEIGHTS: &[SettingChoice] = &[
    SettingChoice::new(
        "projected",
        "weighted by the direction's components: walls are as opaque at a slant as head-on",
    ),
    SettingChoice::new("squared", "weighted by their squares (as in the source)"),
];
const SPECULAR: &[SettingChoice] = &[
    SettingChoice::new("roughness", "a direction sampled from the surface's lobe in each frame"),
    SettingChoice::new("off", "nothing"),
];
const VOLUMES: &[SettingChoice] = &[
    SettingChoice::new("textures", "3-D textures, filtered by the device"),
    SettingChoice::new(
        "buffers",
        "a storage buffer, filtered by the kernel: the same result, slower",
    ),
];

impl Settings for VoxelConeSettings {
    const LIST: &'static [Setting] = &[
        Setting::new(
            "voxels",
            "cells",
            SettingKind::Size { max: MAX_SIZE },
            "Cells along the longest side of the scene's box, and along each side of the inner levels; or three numbers (128x64x64) for the scene's grid",
        ),
        setting::ANISOTROPIC,
        setting::LEVELS,
        setting::POINTS,
        Setting::new("cones", "cones", SettingKind::OneOf(CONE_SETS), "Cones per pixel"),
        Setting::new(
            "bounce-cones",
            "cones",
            SettingKind::OneOf(CONE_SETS),
            "Cones per face of a voxel, for further bounces",
        ),
        Setting::new(
            "bounce-period",
            "frames",
            SettingKind::integer(1, 64),
            "With unlimited bounces: each face of a voxel is updated in one of N frames",
        ),
        Setting::new("tracing", "", SettingKind::Choice(TRACING), "How a cone finds what it sees"),
        Setting::new(
            "step-scale",
            "widths of the cone",
            SettingKind::number(0.05, 4.0),
            "Length of a step",
        ),
        Setting::new(
            "mip-bias",
            "mips",
            SettingKind::number(-4.0, 4.0),
            "Added to the mip that a cone reads",
        ),
        Setting::new(
            "opacity-threshold",
            "",
            SettingKind::number(0.01, 1.0),
            "Opacity at which a cone ends",
        ),
        Setting::new(
            "start",
            "cells",
            SettingKind::number(0.0, 8.0),
            "Distance from the surface at which cones start",
        ),
        Setting::new(
            "face-weights",
            "",
            SettingKind::Choice(FACE_WEIGHTS),
            "How a cone weights a voxel's faces",
        ),
        Setting::new(
            "specular",
            "degrees",
            SettingKind::Number { min: 0.1, max: 119.0, words: SPECULAR },
            "Indirect specular light of glossy surfaces; a number: one cone of this aperture (the source uses 10)",
        ),
        Setting::new(
            "specular-occlusion",
            "",
            SettingKind::Switch,
            "Attenuate specular light by surfaces that are close in the picture",
        ),
        Setting::new(
            "diffuse-occlusion",
            "",
            SettingKind::Switch,
            "Attenuate diffuse light by surfaces that are close in the picture, computed for a quarter of its pixels",
        ),
        Setting::new(
            "fill-gaps",
            "",
            SettingKind::Switch,
            "Give faces of voxels without a surface the mean of their neighbours",
        ),
        Setting::new(
            "opaque-backs",
            "",
            SettingKind::Switch,
            "Stop cones at the backs of single-sided surfaces, too",
        ),
        Setting::new(
            "volumes",
            "",
            SettingKind::Choice(VOLUMES),
            "Where prefiltered voxels are stored",
        ),
        setting::BOUNCES_FROM_ONE,
        setting::SEED,
    ];

    fn get(&self, ix: usize) -> SettingValue {
        use SettingValue::{Integer, Number, Size, Switch, Word};
        match ix {
            0 => match self.resolution {
                Resolution::Longest(n) => Integer(n),
                Resolution::Size(size) => Size(size.to_array()),
            },
            1 => Switch(self.anisotropic),
            2 => setting::of_levels(self.levels),
            3 => Integer(self.points_per_face),
            4 => Integer(self.n_cones),
            5 => Integer(self.n_bounce_cones),
            6 => Integer(self.bounce_period),
            7 => Word(TRACING[usize::from(self.tracing == Tracing::Prefiltered)].name),
            8 => Number(self.stepping.step_scale),
            9 => Number(self.stepping.mip_bias),
            10 => Number(self.stepping.opacity_threshold),
            11 => Number(self.stepping.start_cells),
            12 => Word(FACE_WEIGHTS[usize::from(self.face_weights == FaceWeights::Squared)].name),
            13 => match self.specular {
                Specular::Roughness => Word(SPECULAR[0].name),
                Specular::Off => Word(SPECULAR[1].name),
                Specular::Fixed(degrees) => Number(degrees),
            },
            14 => Switch(self.occludes_specular),
            15 => Switch(self.occludes_diffuse),
            16 => Switch(self.fills_gaps),
            17 => Switch(self.opaque_backs),
            18 => Word(VOLUMES[usize::from(self.storage == PyramidStorage::Buffers)].name),
            19 => setting::of_bounces(self.bounces),
            _ => Integer(self.seed),
        }
    }

    fn set(&mut self, ix: usize, value: SettingValue) {
        use SettingValue::{Integer, Number, Size, Switch, Word};
        match (ix, value) {
            (0, Integer(n)) => self.resolution = Resolution::Longest(n),
            (0, Size(size)) => self.resolution = Resolution::Size(size.into()),
            (1, Switch(is_on)) => self.anisotropic = is_on,
            (2, value) => self.levels = setting::levels_of(value),
            (3, Integer(n)) => self.points_per_face = n,
            (4, Integer(n)) => self.n_cones = n,
            (5, Integer(n)) => self.n_bounce_cones = n,
            (6, Integer(n)) => self.bounce_period = n,
            (7, Word(name)) if name == TRACING[1].name => self.tracing = Tracing::Prefiltered,
            (7, Word(_)) => self.tracing = Tracing::Surfels,
            (8, Number(x)) => self.stepping.step_scale = x,
            (9, Number(x)) => self.stepping.mip_bias = x,
            (10, Number(x)) => self.stepping.opacity_threshold = x,
            (11, Number(x)) => self.stepping.start_cells = x,
            (12, Word(name)) if name == FACE_WEIGHTS[1].name => {
                self.face_weights = FaceWeights::Squared;
            }
            (12, Word(_)) => self.face_weights = FaceWeights::Projected,
            (13, Number(degrees)) => self.specular = Specular::Fixed(degrees),
            (13, Word(name)) if name == SPECULAR[1].name => self.specular = Specular::Off,
            (13, Word(_)) => self.specular = Specular::Roughness,
            (14, Switch(is_on)) => self.occludes_specular = is_on,
            (15, Switch(is_on)) => self.occludes_diffuse = is_on,
            (16, Switch(is_on)) => self.fills_gaps = is_on,
            (17, Switch(is_on)) => self.opaque_backs = is_on,
            (18, Word(name)) if name == VOLUMES[1].name => self.storage = PyramidStorage::Buffers,
            (18, Word(_)) => self.storage = PyramidStorage::Textures,
            (19, value) => self.bounces = setting::bounces_of(value),
            (20, Integer(n)) => self.seed = n,
            _ => {}
        }
    }
}
