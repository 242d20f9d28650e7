// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `voxel-cone`.

use crate::components::voxel_light::{Bounces, Levels, setting};
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
            n_cones: 9,
            n_bounce_cones: 9,
            bounce_period: 4,
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
            7 => Number(self.stepping.step_scale),
            8 => Number(self.stepping.mip_bias),
            9 => Number(self.stepping.opacity_threshold),
            10 => Number(self.stepping.start_cells),
            11 => Word(FACE_WEIGHTS[usize::from(self.face_weights == FaceWeights::Squared)].name),
            12 => match self.specular {
                Specular::Roughness => Word(SPECULAR[0].name),
                Specular::Off => Word(SPECULAR[1].name),
                Specular::Fixed(degrees) => Number(degrees),
            },
            13 => Switch(self.occludes_specular),
            14 => Switch(self.occludes_diffuse),
            15 => Switch(self.fills_gaps),
            16 => Switch(self.opaque_backs),
            17 => Word(VOLUMES[usize::from(self.storage == PyramidStorage::Buffers)].name),
            18 => setting::of_bounces(self.bounces),
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
            (7, Number(x)) => self.stepping.step_scale = x,
            (8, Number(x)) => self.stepping.mip_bias = x,
            (9, Number(x)) => self.stepping.opacity_threshold = x,
            (10, Number(x)) => self.stepping.start_cells = x,
            (11, Word(name)) if name == FACE_WEIGHTS[1].name => {
                self.face_weights = FaceWeights::Squared;
            }
            (11, Word(_)) => self.face_weights = FaceWeights::Projected,
            (12, Number(degrees)) => self.specular = Specular::Fixed(degrees),
            (12, Word(name)) if name == SPECULAR[1].name => self.specular = Specular::Off,
            (12, Word(_)) => self.specular = Specular::Roughness,
            (13, Switch(is_on)) => self.occludes_specular = is_on,
            (14, Switch(is_on)) => self.occludes_diffuse = is_on,
            (15, Switch(is_on)) => self.fills_gaps = is_on,
            (16, Switch(is_on)) => self.opaque_backs = is_on,
            (17, Word(name)) if name == VOLUMES[1].name => self.storage = PyramidStorage::Buffers,
            (17, Word(_)) => self.storage = PyramidStorage::Textures,
            (18, value) => self.bounces = setting::bounces_of(value),
            (19, Integer(n)) => self.seed = n,
            _ => {}
        }
    }
}
