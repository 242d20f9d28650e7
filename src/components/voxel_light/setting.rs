// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings that techniques on the light of voxels share, described.

use super::levels::MAX_LEVELS;
use super::{Bounces, Levels};
use crate::setting::{Setting, SettingKind, SettingValue};

pub(crate) const ANISOTROPIC: Setting = Setting::new(
    "anisotropic",
    "",
    SettingKind::Switch,
    "A value for each of a voxel's six faces, instead of one for all",
);
pub(crate) const LEVELS: Setting = Setting::new(
    "levels",
    "grids",
    SettingKind::Integer { min: 1, max: MAX_LEVELS, word: Some(AUTO) },
    "Nested grids: the coarsest holds the whole scene, the others stand around the camera, with cells half as large from one to the next. `auto`: more than one where that alone would be too coarse for what stands around the camera",
);
pub(crate) const POINTS: Setting = Setting::new(
    "points",
    "points",
    SettingKind::integer(1, 256),
    "Surface points drawn on each voxel's face in each frame",
);
pub(crate) const BOUNCES: Setting = Setting::new(
    "bounces",
    "bounces",
    SettingKind::Integer { min: 0, max: 64, word: Some(UNLIMITED) },
    "How often light is reflected before it reaches the surface that is seen. `unlimited`: each frame adds a bounce, at no more cost than one",
);
/// Of techniques whose light has one bounce at least.
pub(crate) const BOUNCES_FROM_ONE: Setting =
    Setting { kind: SettingKind::Integer { min: 1, max: 64, word: Some(UNLIMITED) }, ..BOUNCES };
pub(crate) const SEED: Setting =
    Setting::new("seed", "", SettingKind::integer(0, u32::MAX), "Stream of random numbers");
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
