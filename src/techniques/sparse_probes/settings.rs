// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of `sparse-probes`.

use crate::components::sparse_probes::{
    Factorisation, Numbers, Sight, SparseLook, SparseSettings, Support,
};
use crate::components::voxel_light::setting;
use crate::techniques::{Setting, SettingChoice, SettingKind, SettingValue, Settings};

/// Settings of `sparse-probes`: those of its bake, and of how it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SparseProbesSettings {
    /// Of the bake.
    pub bake: SparseSettings,
    /// Of its use.
    pub look: SparseLook,
}

/// The settings that are fixed when it has been baked; the others are chosen when it is used.
pub const BAKED: [&str; 14] = [
    "probes",
    "order",
    "texels",
    "second-uv",
    "texel-rays",
    "probe-rays",
    "radius",
    "support",
    "vectors",
    "cluster-size",
    "mutual-visibility",
    "factorisation",
    "numbers",
    "radiance",
];

const SUPPORT: &[SettingChoice] = &[
    SettingChoice::new("fixed", "the same radius for all, but at least two probes that see it"),
    SettingChoice::new("even", "for each receiver the distance of the sixth probe that sees it"),
];

const SIGHT: &[SettingChoice] = &[
    SettingChoice::new("bits", "a bit for each probe and texel, found once"),
    SettingChoice::new("rays", "a ray for each sample and probe: exact, and many times slower"),
];

const FACTORISATION: &[SettingChoice] = &[
    SettingChoice::new("exact", "a singular-value decomposition"),
    SettingChoice::new("randomised", "a randomised one, some ten times faster"),
];

const NUMBERS: &[SettingChoice] = &[
    SettingChoice::new("halfs", "floats of 16 bits"),
    SettingChoice::new("bytes", "8 bits, relative to each vector's largest number"),
];

impl Settings for SparseProbesSettings {
    const LIST: &'static [Setting] = &[
        Setting::new(
            "probes",
            "probes",
            SettingKind::integer(0, 4096),
            "Probes, at most: placed so that they see most of what surfaces see; 0: 64 to 512, until they count as far as surfaces see each other",
        ),
        Setting::new(
            "order",
            "",
            SettingKind::integer(0, 7),
            "Order of the probes' spherical harmonics: (order + 1)^2 coefficients",
        ),
        Setting::new(
            "texels",
            "texels",
            SettingKind::integer(16, 1 << 24),
            "About how many texels of the lightmap surfaces get, by their area",
        ),
        Setting::new(
            "second-uv",
            "",
            SettingKind::Switch,
            "Use second texture coordinates of the file, where they are those of a lightmap",
        ),
        Setting::new(
            "texel-rays",
            "rays",
            SettingKind::integer(64, 1 << 20),
            "Rays of each texel, in steps of 64",
        ),
        Setting::new(
            "probe-rays",
            "rays",
            SettingKind::integer(64, 1 << 16),
            "Directions in which each probe looks, in steps of 64",
        ),
        Setting::new(
            "radius",
            "m",
            SettingKind::number(0.0, 1e6),
            "Within which probes count for a texel; 0: chosen by the area of surfaces",
        ),
        Setting::new("support", "", SettingKind::Choice(SUPPORT), "How that radius is found"),
        Setting::new(
            "vectors",
            "vectors",
            SettingKind::integer(1, 128),
            "Vectors that are kept of each cluster of texels",
        ),
        Setting::new(
            "cluster-size",
            "texels",
            SettingKind::integer(1, 4096),
            "Texels of a cluster, at most",
        ),
        Setting::new(
            "mutual-visibility",
            "",
            SettingKind::Choice(SIGHT),
            "How it is found out which probes see what a texel sees",
        ),
        Setting::new(
            "factorisation",
            "",
            SettingKind::Choice(FACTORISATION),
            "How transport matrices are factorised",
        ),
        Setting::new(
            "numbers",
            "",
            SettingKind::Choice(NUMBERS),
            "How the factors of the transport are stored",
        ),
        Setting::new(
            "radiance",
            "",
            SettingKind::integer(0, 4),
            "Order of the radiance that arrives at texels, for normal maps and glossy surfaces; 0: irradiance alone",
        ),
        Setting::new(
            "update-every",
            "frames",
            SettingKind::integer(1, 1024),
            "Update one of so many probes in each frame",
        ),
        Setting::new("feedback", "", SettingKind::Switch, "Reflect reflected light again"),
        Setting::new(
            "light-frames",
            "frames",
            SettingKind::integer(1, 1 << 16),
            "Frames over which light of emissive surfaces and the sky is averaged",
        ),
        setting::SEED,
    ];

    fn get(&self, ix: usize) -> SettingValue {
        use SettingValue::{Integer, Number, Switch, Word};
        let (bake, look) = (&self.bake, &self.look);
        match ix {
            0 => Integer(bake.n_probes),
            1 => Integer(bake.order),
            2 => Integer(bake.n_texels),
            3 => Switch(bake.uses_second_uv),
            4 => Integer(bake.n_rays),
            5 => Integer(bake.n_directions),
            6 => Number(bake.radius),
            7 => Word(SUPPORT[bake.support as usize].name),
            8 => Integer(bake.n_vectors),
            9 => Integer(bake.cluster_size),
            10 => Word(SIGHT[bake.sight as usize].name),
            11 => Word(FACTORISATION[bake.factorisation as usize].name),
            12 => Word(NUMBERS[bake.numbers as usize].name),
            13 => Integer(bake.radiance),
            14 => Integer(look.update_every),
            15 => Switch(look.bounces),
            16 => Integer(look.n_light_frames),
            _ => Integer(bake.seed),
        }
    }

    fn set(&mut self, ix: usize, value: SettingValue) {
        use SettingValue::{Integer, Number, Switch, Word};
        let (bake, look) = (&mut self.bake, &mut self.look);
        match (ix, value) {
            (0, Integer(n)) => bake.n_probes = n,
            (1, Integer(n)) => bake.order = n,
            (2, Integer(n)) => bake.n_texels = n,
            (3, Switch(is_on)) => bake.uses_second_uv = is_on,
            (4, Integer(n)) => bake.n_rays = n.next_multiple_of(64),
            (5, Integer(n)) => bake.n_directions = n.next_multiple_of(64),
            (6, Number(metres)) => bake.radius = metres,
            (7, Word(name)) => {
                bake.support = if name == "even" { Support::Even } else { Support::Fixed };
            }
            (8, Integer(n)) => bake.n_vectors = n,
            (9, Integer(n)) => bake.cluster_size = n,
            (10, Word(name)) => bake.sight = if name == "rays" { Sight::Rays } else { Sight::Bits },
            (11, Word(name)) => {
                bake.factorisation = match name {
                    "randomised" => Factorisation::Randomised,
                    _ => Factorisation::Exact,
                };
            }
            (12, Word(name)) => {
                bake.numbers = if name == "bytes" { Numbers::Bytes } else { Numbers::Halfs };
            }
            (13, Integer(n)) => bake.radiance = n,
            (14, Integer(n)) => look.update_every = n,
            (15, Switch(is_on)) => look.bounces = is_on,
            (16, Integer(n)) => look.n_light_frames = n,
            (17, Integer(n)) => (bake.seed, look.seed) = (n, n),
            _ => {}
        }
    }
}
