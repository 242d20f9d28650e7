// SPDX-License-Identifier: MIT OR Apache-2.0
//! Descriptions of the settings that techniques based on the light of voxels share.

use super::levels::MAX_LEVELS;
use super::{Bounces, Levels};
use crate::setting::{Setting, SettingKind, SettingValue};

pub(crate) const ANISOTROPIC: Setting = Setting::new(
    "anisotropic",
    "",
    SettingKind::Switch,
    "Store a value for each of a voxel's six faces, instead of one for all",
);
pub(crate) const LEVELS: Setting = Setting::new(
    "levels",
    "grids",
    SettingKind::Integer { min: 1, max: MAX_LEVELS, word: Some(AUTO) },
    "Number of nested grids: the coarsest holds the whole scene, the others are around the camera, each with cells half as large as the next. `auto`: more than one if one would be too coarse for what is around the camera",
);
pub(crate) const POINTS: Setting = Setting::new(
    "points",
    "points",
    SettingKind::integer(1, 256),
    "Surface points sampled on each face of a voxel in each frame",
);
pub(crate) const BOUNCES: Setting = Setting::new(
    "bounces",
    "bounces",
    SettingKind::Integer { min: 0, max: 64, word: Some(UNLIMITED) },
    "How often light is reflected before it reaches the surface that is seen. `unlimited`: each frame adds a bounce, at no more cost than one",
);
/// For techniques whose light has at least one bounce.
pub(crate) const BOUNCES_FROM_ONE: Setting =
    Setting { kind: SettingKind::Integer { min: 1, max: 64, word: Some(UNLIMITED) }, ..BOUNCES };
pub(crate) const SEED: Setting =
    Setting::new("seed", "", SettingKind::integer(0, u32::MAX), "Seed of the random numbers");
const AUTO: &str = "auto";
const UNLIMITED: &str = "unlimited";

pub(crate) fn of_levels(levels: Levels) -> SettingValue {
    match levels {
        Levels::Auto => SettingValue::Word(AUTO),
        Levels::Nested(n) => SettingValue::Integer(n),
    }
}

pub(crate) fn levels_of(value: SettingValue) -> Levels {
    match value {
        SettingValue::Integer(n) => Levels::Nested(n),
        _ => Levels::Auto,
    }
}

pub(crate) fn of_bounces(bounces: Bounces) -> SettingValue {
    match bounces {
        Bounces::Unlimited => SettingValue::Word(UNLIMITED),
        Bounces::UpTo(n) => SettingValue::Integer(n),
    }
}

pub(crate) fn bounces_of(value: SettingValue) -> Bounces {
    match value {
        SettingValue::Integer(n) => Bounces::UpTo(n),
        _ => Bounces::Unlimited,
    }
}
