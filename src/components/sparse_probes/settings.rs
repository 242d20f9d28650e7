// SPDX-License-Identifier: MIT OR Apache-2.0
//! Settings of a bake of sparse probes.

/// How the radius is found within which probes count for a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Support {
    /// The same radius for all; a receiver that fewer than two probes within it see has a larger one.
    #[default]
    Fixed,
    /// For each receiver, so that about as many probes count for each.
    Even,
}

/// How mutual visibility of receivers and probes is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sight {
    /// A bit for each probe and receiver, found once, and a mask of the sky for each probe.
    #[default]
    Bits,
    /// A ray for each sample and probe: exact, and many times slower.
    Rays,
}

/// How transport matrices are factorised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Factorisation {
    /// A singular-value decomposition.
    #[default]
    Exact,
    /// A randomised one (N. Halko, P. Martinsson, J. Tropp, "Finding Structure with Randomness", SIAM Review 53(2), 2011): eight more vectors than
    /// are kept, two power iterations.
    Randomised,
}

/// How the numbers of the factors are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Numbers {
    /// Floats of 16 bits.
    #[default]
    Halfs,
    /// Whole numbers of 8 bits, relative to the largest one of each vector.
    Bytes,
}

impl Numbers {
    /// Numbers of a word of 32 bits.
    pub fn in_word(self) -> usize {
        match self {
            Self::Halfs => 2,
            Self::Bytes => 4,
        }
    }
}

/// The fewest probes that see a receiver and count for it, if there are as many: its radius is larger, if need be. (One leaves dark arcs, where it does not
/// see what is bright; with four, light is spread farther: in the Cornell box an error of L* of 1.01 instead of 0.85.)
pub const LEAST_SEEING: usize = 2;
/// The fewest that count for a receiver that too few probes see.
pub const LEAST_NEAR: usize = 4;
/// Probes that see a receiver and count for it with [`Support::Even`].
pub const EVEN_NEAR: usize = 6;

/// Words of settings in a file.
pub(super) const N_WORDS: usize = 15;

/// Settings of a bake of sparse probes.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SparseSettings {
    /// The most probes; 0: 64 to 512, until they count as far as surfaces see each other in the mean.
    pub n_probes: u32,
    /// Order of the probes' spherical harmonics, 0 to 7: (order + 1)² coefficients.
    pub order: u32,
    /// About how many texels surfaces get.
    pub n_texels: u32,
    /// Whether meshes' second texture coordinates are used, where they are valid.
    pub uses_second_uv: bool,
    /// Rays of each receiver, in steps of 64.
    pub n_rays: u32,
    /// Directions in which each probe looks, in steps of 64.
    pub n_directions: u32,
    /// Within which probes count for a receiver \[m\]; 0: chosen by the area of surfaces.
    pub radius: f32,
    /// How the radius is found.
    pub support: Support,
    /// Vectors that are kept of each cluster, at most 128.
    pub n_vectors: u32,
    /// The most receivers of a cluster.
    pub cluster_size: u32,
    /// How mutual visibility is found.
    pub sight: Sight,
    /// How transport matrices are factorised.
    pub factorisation: Factorisation,
    /// How the factors are stored.
    pub numbers: Numbers,
    /// Order of the spherical harmonics of the radiance that arrives at receivers, 1 to 4, for normal maps and glossy surfaces; 0: irradiance alone.
    pub radiance: u32,
    /// Seed of the random numbers.
    pub seed: u32,
}

impl Default for SparseSettings {
    fn default() -> Self {
        Self {
            n_probes: 0,
            order: 4,
            n_texels: 40_000,
            uses_second_uv: true,
            n_rays: 1024,
            n_directions: 1024,
            radius: 0.0,
            support: Support::Fixed,
            n_vectors: 64,
            cluster_size: 1024,
            sight: Sight::Bits,
            factorisation: Factorisation::Exact,
            numbers: Numbers::Halfs,
            radiance: 0,
            seed: 0,
        }
    }
}

impl SparseSettings {
    /// Coefficients of a probe.
    pub fn n_coefficients(&self) -> u32 {
        (self.order + 1) * (self.order + 1)
    }

    /// Coefficients of the radiance that arrives at a receiver; 0: none are kept.
    pub fn n_radiance(&self) -> u32 {
        if self.radiance == 0 { 0 } else { (self.radiance + 1) * (self.radiance + 1) }
    }

    /// Numbers of each colour that a receiver gets: irradiance; and with radiance, its coefficients and what they lack of the irradiance.
    pub fn n_outputs(&self) -> u32 {
        if self.radiance == 0 { 1 } else { 2 + self.n_radiance() }
    }

    /// As numbers of a file.
    pub(super) fn words(&self) -> [u32; N_WORDS] {
        [
            self.n_probes,
            self.order,
            self.n_texels,
            u32::from(self.uses_second_uv),
            self.n_rays,
            self.n_directions,
            self.radius.to_bits(),
            self.support as u32,
            self.n_vectors,
            self.cluster_size,
            self.sight as u32,
            self.factorisation as u32,
            self.numbers as u32,
            self.radiance,
            self.seed,
        ]
    }

    /// Inverse of [`Self::words`]; None: they are not possible.
    pub(super) fn of_words(words: [u32; N_WORDS]) -> Option<Self> {
        let out = Self {
            n_probes: words[0],
            order: words[1],
            n_texels: words[2],
            uses_second_uv: words[3] != 0,
            n_rays: words[4],
            n_directions: words[5],
            radius: f32::from_bits(words[6]),
            support: if words[7] == 0 { Support::Fixed } else { Support::Even },
            n_vectors: words[8],
            cluster_size: words[9],
            sight: if words[10] == 0 { Sight::Bits } else { Sight::Rays },
            factorisation: if words[11] == 0 {
                Factorisation::Exact
            } else {
                Factorisation::Randomised
            },
            numbers: if words[12] == 0 { Numbers::Halfs } else { Numbers::Bytes },
            radiance: words[13],
            seed: words[14],
        };
        let is_possible = out.order <= 7
            && out.radiance <= 4
            && out.n_directions.is_multiple_of(64)
            && (64..=1 << 20).contains(&out.n_directions)
            && (1..=128).contains(&out.n_vectors)
            && (1..=1 << 16).contains(&out.cluster_size)
            && out.radius.is_finite()
            && out.radius >= 0.0;
        is_possible.then_some(out)
    }
}
