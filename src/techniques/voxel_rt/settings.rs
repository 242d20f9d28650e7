// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `voxel-rt`.

use crate::components::voxel_light::{
    Bounces, DirectLight, Levels, RaysInjected, VoxelLightSettings, WriteStrategy, setting,
};
use crate::components::voxels::{MAX_SIZE, Resolution};
use crate::techniques::{Setting, SettingChoice, SettingKind, SettingValue, Settings};

/// How pixels read the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lookup {
    /// Trilinear over the cells with surfaces that face the same way as the pixel's.
    #[default]
    Valid,
    /// Trilinear over all eight cells, where empty ones count as dark: the source's lookup, for comparison.
    Trilinear,
    /// The mean of seven such lookups, one cell apart along each axis: the source's remedy for the dark streaks of
    /// [`Self::Trilinear`].
    SevenTap,
}

/// Settings of `voxel-rt`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VoxelRtSettings {
    /// Cells along the longest side of the scene's box, and along each side of the inner levels: 1 to 256.
    pub resolution: u32,
    /// Whether to store a value for each of a voxel's six faces; otherwise one per voxel.
    pub anisotropic: bool,
    /// Nested grids.
    pub levels: Levels,
    /// Surface points sampled on each face in each frame, at least 1. Each costs a short ray and, if that hits a
    /// surface, a shadow ray and a bounce.
    pub points_per_face: u32,
    /// Rays that a face averages over, at least 1. With more of them the light is smoother, but follows unreported
    /// changes more slowly.
    pub max_rays: u32,
    /// How direct light reaches the voxels.
    pub direct: DirectLight,
    /// How often light is reflected.
    pub bounces: Bounces,
    /// How pixels read the grid.
    pub lookup: Lookup,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Default for VoxelRtSettings {
    fn default() -> Self {
        Self {
            resolution: 128,
            anisotropic: true,
            levels: Levels::Auto,
            points_per_face: 1,
            max_rays: 1024,
            direct: DirectLight::PerFace,
            bounces: Bounces::Unlimited,
            lookup: Lookup::Valid,
            seed: 0,
        }
    }
}

impl From<VoxelRtSettings> for VoxelLightSettings {
    fn from(settings: VoxelRtSettings) -> Self {
        let VoxelRtSettings {
            resolution,
            anisotropic,
            levels,
            points_per_face,
            max_rays,
            direct,
            bounces,
            lookup: _,
            seed,
        } = settings;
        Self {
            resolution: Resolution::Longest(resolution),
            anisotropic,
            levels,
            points_per_face,
            max_rays,
            direct,
            bounces,
            finds_reflected: true,
            divides: true,
            seed,
        }
    }
}

const INJECT: &[SettingChoice] = &[
    SettingChoice::new(
        "faces",
        "every face of a voxel samples points and lights, and traces shadow rays",
    ),
    SettingChoice::new("lights", "rays start at the lights (as in the source)"),
    SettingChoice::new("camera", "rays start at the camera"),
];
const WRITE: &[SettingChoice] = &[
    SettingChoice::new("store", "the last writer wins (racy; 8 bits per channel)"),
    SettingChoice::new(
        "moving-average",
        "moving average of up to 255 samples by compare-and-swap (8 bits per channel; as in the source)",
    ),
    SettingChoice::new("max", "the largest (8 bits per channel)"),
    SettingChoice::new("exact", "the exact mean, independent of the order"),
];
const LOOKUP: &[SettingChoice] = &[
    SettingChoice::new(
        "valid",
        "trilinear over cells with surfaces that face the same way as the pixel's",
    ),
    SettingChoice::new(
        "trilinear",
        "trilinear over all cells, where empty ones count as dark (as in the source)",
    ),
    SettingChoice::new("seven-tap", "the mean of seven such lookups (as in the source)"),
];
const STRATEGIES: [WriteStrategy; 4] = WriteStrategy::ALL;
const LOOKUPS: [Lookup; 3] = [Lookup::Valid, Lookup::Trilinear, Lookup::SevenTap];

/// The index of the choice of this name.
fn place(choices: &[SettingChoice], name: &str) -> usize {
    choices.iter().position(|choice| choice.name == name).unwrap_or(0)
}

/// The name of the choice whose value this is.
fn name_of<T: PartialEq>(choices: &[SettingChoice], values: &[T], value: T) -> SettingValue {
    let at = values.iter().position(|of| *of == value);
    SettingValue::Word(choices[at.unwrap_or(0)].name)
}

impl Settings for VoxelRtSettings {
    const LIST: &'static [Setting] = &[
        Setting::new(
            "voxels",
            "cells",
            SettingKind::integer(1, MAX_SIZE),
            "Cells along the longest side of the scene's box, and along each side of the inner levels",
        ),
        setting::ANISOTROPIC,
        setting::LEVELS,
        setting::POINTS,
        Setting::new(
            "max-rays",
            "rays",
            SettingKind::integer(1, 65536),
            "Rays that a face averages over: with more of them light is smoother, but follows unreported changes more slowly",
        ),
        Setting::new(
            "inject",
            "",
            SettingKind::Choice(INJECT),
            "How direct light reaches the voxels",
        ),
        Setting::new(
            "inject-rays",
            "rays",
            SettingKind::integer(1, 4096),
            "With `inject` lights or camera: N × N rays per frame (and per light)",
        ),
        Setting::new(
            "write",
            "",
            SettingKind::Choice(WRITE),
            "With `inject` lights or camera: how rays that hit the same face of a voxel are combined",
        ),
        Setting::new("lookup", "", SettingKind::Choice(LOOKUP), "How pixels read the grid"),
        setting::BOUNCES,
        setting::SEED,
    ];

    fn get(&self, ix: usize) -> SettingValue {
        match ix {
            0 => SettingValue::Integer(self.resolution),
            1 => SettingValue::Switch(self.anisotropic),
            2 => setting::of_levels(self.levels),
            3 => SettingValue::Integer(self.points_per_face),
            4 => SettingValue::Integer(self.max_rays),
            5 => SettingValue::Word(
                INJECT[match self.direct {
                    DirectLight::PerFace => 0,
                    DirectLight::FromLights(_) => 1,
                    DirectLight::FromCamera(_) => 2,
                }]
                .name,
            ),
            6 => SettingValue::Integer(self.rays().n_rays),
            7 => name_of(WRITE, &STRATEGIES, self.rays().strategy),
            8 => name_of(LOOKUP, &LOOKUPS, self.lookup),
            9 => setting::of_bounces(self.bounces),
            _ => SettingValue::Integer(self.seed),
        }
    }

    fn set(&mut self, ix: usize, value: SettingValue) {
        let rays = self.rays();
        match (ix, value) {
            (0, SettingValue::Integer(n)) => self.resolution = n,
            (1, SettingValue::Switch(is_on)) => self.anisotropic = is_on,
            (2, value) => self.levels = setting::levels_of(value),
            (3, SettingValue::Integer(n)) => self.points_per_face = n,
            (4, SettingValue::Integer(n)) => self.max_rays = n,
            (5, SettingValue::Word(name)) => {
                self.direct = match place(INJECT, name) {
                    1 => DirectLight::FromLights(rays),
                    2 => DirectLight::FromCamera(rays),
                    _ => DirectLight::PerFace,
                }
            }
            (6, SettingValue::Integer(n_rays)) => self.set_rays(RaysInjected { n_rays, ..rays }),
            (7, SettingValue::Word(name)) => {
                let strategy = STRATEGIES[place(WRITE, name)];
                self.set_rays(RaysInjected { strategy, ..rays });
            }
            (8, SettingValue::Word(name)) => self.lookup = LOOKUPS[place(LOOKUP, name)],
            (9, value) => self.bounces = setting::bounces_of(value),
            (10, SettingValue::Integer(n)) => self.seed = n,
            _ => {}
        }
    }
}

impl VoxelRtSettings {
    /// The injected rays; the defaults if there are none.
    fn rays(&self) -> RaysInjected {
        match self.direct {
            DirectLight::PerFace => RaysInjected::default(),
            DirectLight::FromLights(rays) | DirectLight::FromCamera(rays) => rays,
        }
    }

    /// Has no effect if faces sample the lights themselves.
    fn set_rays(&mut self, rays: RaysInjected) {
        match &mut self.direct {
            DirectLight::PerFace => {}
            DirectLight::FromLights(of) | DirectLight::FromCamera(of) => *of = rays,
        }
    }
}
