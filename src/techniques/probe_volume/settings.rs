// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `probe-volume`.

use crate::components::probes::{ProbeSettings, ProbeVisibility};
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
        setting::SEED,
    ];

    fn get(&self, ix: usize) -> SettingValue {
        use SettingValue::{Integer, Number, Switch, Word};
        let of = &self.0;
        match ix {
            0 => Integer(of.cells),
            1 => Integer(of.n_paths),
            2 => Integer(of.n_bounces),
            3 => Word(
                VISIBILITY[match of.visibility {
                    ProbeVisibility::None => 0,
                    ProbeVisibility::Distances => 1,
                }]
                .name,
            ),
            4 => Switch(of.wraps),
            5 => Number(of.normal_bias),
            6 => Number(of.bleeding),
            7 => Number(of.window),
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
            (3, Word(name)) => {
                of.visibility = match name {
                    "none" => ProbeVisibility::None,
                    _ => ProbeVisibility::Distances,
                }
            }
            (4, Switch(is_on)) => of.wraps = is_on,
            (5, Number(cells)) => of.normal_bias = cells,
            (6, Number(chance)) => of.bleeding = chance,
            (7, Number(lambda)) => of.window = lambda,
            (8, Integer(n)) => of.seed = n,
            _ => {}
        }
    }
}
