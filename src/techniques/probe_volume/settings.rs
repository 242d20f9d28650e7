// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `probe-volume`.

use crate::components::probes::{ProbeBasis, ProbeSettings, ProbeVisibility};
use crate::components::voxel_light::setting;
use crate::techniques::{Setting, SettingChoice, SettingKind, SettingValue, Settings};

/// Settings of `probe-volume`: those of its probes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProbeVolumeSettings(pub ProbeSettings);

const VISIBILITY: &[SettingChoice] = &[
    SettingChoice::new("none", "all probes count"),
    SettingChoice::new(
        "distances",
        "probes that are farther away than what they see in that direction count less",
    ),
    SettingChoice::new(
        "masks",
        "probes do not count in parts of a cell that surfaces hide from them, by a bit for each of 64 (not for bakes and nets)",
    ),
];

/// In the order of [`ProbeBasis::ALL`].
const BASIS: &[SettingChoice] = &[
    SettingChoice::new("sh2", "spherical harmonics of order 2 as halfs, 56 bytes"),
    SettingChoice::new("sh2-float", "the same as f32, 108 bytes"),
    SettingChoice::new("sh2-bytes", "the same, all but the constants as bytes, 32 bytes"),
    SettingChoice::new("sh1", "spherical harmonics of order 1 as halfs, 28 bytes"),
    SettingChoice::new("ambient-cube", "irradiance along six axes as halfs, 40 bytes"),
    SettingChoice::new("chroma-sh1", "luma of order 2, hues of order 1, as halfs, 36 bytes"),
    SettingChoice::new("chroma-constant", "luma of order 2, mean hues, as halfs, 24 bytes"),
    SettingChoice::new(
        "sh4",
        "spherical harmonics of order 4 as halfs, 112 bytes (not for bakes; paths are followed twice)",
    ),
];

impl Settings for ProbeVolumeSettings {
    const LIST: &'static [Setting] = &[
        Setting::new(
            "cells",
            "cells",
            SettingKind::integer(2, 128),
            "Cells along the longest side of the scene's box; probes are at the corners of those with surfaces",
        ),
        Setting::new(
            "paths",
            "paths",
            SettingKind::integer(1, 1 << 20),
            "Paths that each probe follows, in batches of 64, one each frame",
        ),
        Setting::new(
            "bounces",
            "bounces",
            SettingKind::integer(1, 64),
            "How often light is reflected before it reaches the surface that is seen",
        ),
        Setting::new(
            "noise",
            "",
            SettingKind::number(0.0, 1.0),
            "Let a probe stop before, once its light is known to this share (standard error); 0: it never does",
        ),
        Setting::new(
            "refine",
            "",
            SettingKind::number(0.0, 1.0),
            "Divide cells of twice the size only where light between probes is off by more than this share; 0: all",
        ),
        Setting::new("basis", "", SettingKind::Choice(BASIS), "How probes keep their light"),
        Setting::new(
            "relocation",
            "",
            SettingKind::Switch,
            "Move probes away from surfaces that are very near",
        ),
        Setting::new(
            "visibility",
            "",
            SettingKind::Choice(VISIBILITY),
            "How a surface finds out which of the probes around it see it",
        ),
        Setting::new("wrap", "", SettingKind::Switch, "Let probes behind the surface count less"),
        Setting::new(
            "normal-bias",
            "cells",
            SettingKind::number(0.0, 1.0),
            "How far points are moved along their normal before distances are compared",
        ),
        Setting::new(
            "bleeding",
            "",
            SettingKind::number(0.0, 0.99),
            "Probes that are seen with less than this chance, by their distances, hardly count",
        ),
        Setting::new(
            "window",
            "",
            SettingKind::number(0.0, 1.0),
            "Blur of the probes' light against ringing: bands are divided by 1 + window · l²(l + 1)²",
        ),
        Setting::new(
            "roots",
            "",
            SettingKind::Switch,
            "Blend the roots of irradiances: light falls off convexly, and straight lines between probes are above that",
        ),
        setting::SEED,
    ];

    fn get(&self, ix: usize) -> SettingValue {
        use SettingValue::{Integer, Number, Switch, Word};
        let of = &self.0;
        match ix {
            0 => Integer(of.cells),
            1 => Integer(of.n_paths),
            2 => Integer(of.n_bounces),
            3 => Number(of.noise),
            4 => Number(of.refine),
            5 => Word(BASIS[ProbeBasis::ALL.iter().position(|b| *b == of.basis).unwrap_or(0)].name),
            6 => Switch(of.moves),
            7 => Word(
                VISIBILITY[match of.visibility {
                    ProbeVisibility::None => 0,
                    ProbeVisibility::Distances => 1,
                    ProbeVisibility::Masks => 2,
                }]
                .name,
            ),
            8 => Switch(of.wraps),
            9 => Number(of.normal_bias),
            10 => Number(of.bleeding),
            11 => Number(of.window),
            12 => Switch(of.roots),
            _ => Integer(of.seed),
        }
    }

    fn set(&mut self, ix: usize, value: SettingValue) {
        use SettingValue::{Integer, Number, Switch, Word};
        let of = &mut self.0;
        match (ix, value) {
            (0, Integer(n)) => of.cells = n,
            (1, Integer(n)) => of.n_paths = n,
            (2, Integer(n)) => of.n_bounces = n,
            (3, Number(share)) => of.noise = share,
            (4, Number(share)) => of.refine = share,
            (5, Word(name)) => {
                let ix = BASIS.iter().position(|choice| choice.name == name);
                of.basis = ix.map(|ix| ProbeBasis::ALL[ix]).unwrap_or_default();
            }
            (6, Switch(is_on)) => of.moves = is_on,
            (7, Word(name)) => {
                of.visibility = match name {
                    "none" => ProbeVisibility::None,
                    "masks" => ProbeVisibility::Masks,
                    _ => ProbeVisibility::Distances,
                }
            }
            (8, Switch(is_on)) => of.wraps = is_on,
            (9, Number(cells)) => of.normal_bias = cells,
            (10, Number(chance)) => of.bleeding = chance,
            (11, Number(lambda)) => of.window = lambda,
            (12, Switch(is_on)) => of.roots = is_on,
            (13, Integer(n)) => of.seed = n,
            _ => {}
        }
    }
}
