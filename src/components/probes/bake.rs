// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes as data and as files.
//!
//! All numbers of a file are little-endian:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `LUCPROBE` |
//! | 4 | the version of the format, 2 |
//! | 4 | number of probes |
//! | 12 | corners of the lattice along each axis; 0: probes are at the points of a net |
//! | 4, 12 | edge of a cell \[m\], where corner (0, 0, 0) is \[m\], f32; 0 for a net |
//! | 4, 4, 4, 4, 4, 4, 4 | cells; paths; bounces; seed; 1 if probes move; noise (f32); refine (f32) |
//! | 24 | the scene's fingerprint: shape, pose, light |
//! | 12 a brick of 4 × 4 × 2 corners, only of a lattice | which of its corners have probes, the first of them, and the low half of XXH3 of all of them |
//! | 8 | XXH3 (64 bits) of everything before |
//! | 408 a probe | [`BakedProbe`] |
//! | 12 a probe, only of a net | where it is \[m\], f32 |
//! | 8 | XXH3 (64 bits) of everything before |
//!
//! So a part of a lattice can be read, and checked, without the rest ([`ProbeFile`](super::ProbeFile)).

use super::settings::ProbeSettings;
use super::{COEFFICIENTS, MAP_SIDE};
use crate::components::voxels::{BRICK, MAX_SIZE, VoxelGrid, n_bricks};
use crate::picture::write_whole_file;
use crate::scene::SceneFingerprint;
use crate::settings;
use glam::{UVec3, Vec3};
use std::cmp::Ordering;
use std::io::{self, Write};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u8; 8] = *b"LUCPROBE";
const VERSION: u32 = 2;
pub(super) const HEADER_BYTES: usize = 8 + 4 * 16 + 3 * 8;
pub(super) const CHECKSUM_BYTES: usize = 8;
const POINT_BYTES: usize = 12;
/// Words of a brick in the index.
pub(super) const ENTRY_WORDS: usize = 3;

/// One probe of a [`ProbeBake`].
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct BakedProbe {
    /// Its corner of the lattice, 10 bits for each axis, x lowest; 0 in a net.
    pub corner: u32,
    /// Where it is, relative to its corner, and whether it is inside something (`wgsl/components/probes/place.wgsl`).
    pub place: u32,
    /// What it has gathered (`wgsl/components/probes/gathered.wgsl`).
    pub gathered: [[f32; 4]; COEFFICIENTS as usize],
    /// Mean distance \[cells\] and mean of its square, two halfs for each texel.
    pub distances: [u32; (MAP_SIDE * MAP_SIDE) as usize],
}

pub(super) const PROBE_BYTES: usize = size_of::<BakedProbe>();

impl BakedProbe {
    /// Its corner of the lattice.
    pub fn corner(&self) -> UVec3 {
        UVec3::new(self.corner & 1023, self.corner >> 10 & 1023, self.corner >> 20)
    }

    /// How far it was moved from its corner \[cells\].
    pub fn moved(&self) -> Vec3 {
        let steps = |shift: u32| ((self.place << (22 - shift)) as i32 >> 22) as f32;
        Vec3::new(steps(0), steps(10), steps(20)) / 1024.0
    }

    /// Whether it is inside something, or behind a wall.
    pub fn is_inside(&self) -> bool {
        self.place >> 30 & 1 == 1
    }

    /// Whether its numbers are possible. `ix`: which one it is, for the message.
    pub(super) fn validate(&self, ix: usize) -> Result<(), BakeError> {
        let invalid = |what: String| Err(BakeError::Invalid(what));
        if !self.gathered.as_flattened().iter().all(|number| number.is_finite()) {
            return invalid(format!("the light of probe {ix} is not finite"));
        }
        let halfs = self.distances.iter().flat_map(|two| [*two, *two >> 16]);
        // (Infinity and NaN have all bits of the exponent.)
        if halfs.into_iter().any(|half| half >> 10 & 31 == 31) {
            return invalid(format!("a distance of probe {ix} is not finite"));
        }
        Ok(())
    }

    /// Coefficients of the radiance that arrives, order 2 \[W·sr⁻¹·m⁻²\].
    pub fn light(&self) -> [Vec3; COEFFICIENTS as usize] {
        self.gathered.map(|of| Vec3::from_slice(&of))
    }
}

/// Where baked probes are.
#[derive(Clone, Debug, PartialEq)]
pub enum BakedLayout {
    /// At corners of a lattice.
    Lattice {
        /// Where corner (0, 0, 0) is \[m\].
        origin: Vec3,
        /// Edge of a cell \[m\].
        cell: f32,
        /// Corners along each axis.
        size: UVec3,
    },
    /// At the points of a net.
    Net {
        /// One for each probe \[m\], as [`ProbeNet::points`](crate::components::probe_net::ProbeNet::points) has them.
        points: Vec<Vec3>,
    },
}

/// Probes that have gathered light, as data.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeBake {
    /// The scene that they were made for.
    pub scene: SceneFingerprint,
    /// Those settings that matter for what is kept: cells, bounces, seed, moves, noise, refine. The others are of the look-up, and can be
    /// chosen anew.
    pub settings: ProbeSettings,
    /// Paths that each probe has followed, unless it stopped before.
    pub n_paths: u32,
    /// Where they are.
    pub layout: BakedLayout,
    /// In the order of their slots.
    pub probes: Vec<BakedProbe>,
}

/// A file of probes cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The system's error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is something else.
    #[error("it is not a file of baked probes (it does not begin with LUCPROBE)")]
    Foreign,
    /// It was written by a later version.
    #[error(
        "it has version {0} of the format, and this program reads version {VERSION}: use a newer lucerna, or bake again"
    )]
    Newer(u32),
    /// It was written by an earlier version.
    #[error(
        "it has version {0} of the format, and this program reads version {VERSION}: bake again"
    )]
    Older(u32),
    /// A part is missing.
    #[error("it is truncated: it has {found} bytes, and {expected} are expected; bake again")]
    Truncated {
        /// Its bytes.
        found: u64,
        /// The bytes of a file with as many probes.
        expected: u64,
    },
    /// It has changed since it was written.
    #[error("it is damaged: its checksum is not that of its contents; bake again")]
    Damaged,
    /// Numbers are not possible.
    #[error("it is not valid: {0}")]
    Invalid(String),
    /// It belongs to another scene.
    #[error(
        "it was baked for another scene: its meshes, or which of them are placed, are different"
    )]
    OtherScene,
}

impl ProbeBake {
    /// Where each probe is \[m\].
    pub fn positions(&self) -> Vec<Vec3> {
        match &self.layout {
            BakedLayout::Lattice { origin, cell, .. } => {
                let at = |probe: &BakedProbe| {
                    *origin + (probe.corner().as_vec3() + probe.moved()) * *cell
                };
                self.probes.iter().map(at).collect()
            }
            BakedLayout::Net { points } => points.clone(),
        }
    }

    /// What has changed in a scene since it was baked, in sentences; empty if nothing has.
    ///
    /// # Errors
    /// [`BakeError::OtherScene`]: the scene has other surfaces.
    pub fn check(&self, scene: &SceneFingerprint) -> Result<Vec<String>, BakeError> {
        if self.scene.shape != scene.shape {
            return Err(BakeError::OtherScene);
        }
        let mut changes = Vec::new();
        if self.scene.pose != scene.pose {
            changes.push(
                "things have moved since the probes were baked: their light and their distances are those of before; bake again".into(),
            );
        }
        if self.scene.light != scene.light {
            changes.push(
                "lights, the sky or materials have changed since the probes were baked: indirect light is that of before; bake again".into(),
            );
        }
        Ok(changes)
    }

    /// Whether its places and distances are those of a bake with these settings, and the same net, if any.
    pub fn is_placed_like(&self, settings: &ProbeSettings, net: Option<&[Vec3]>) -> bool {
        if let BakedLayout::Net { points } = &self.layout {
            return net == Some(points);
        }
        net.is_none()
            && self.settings.refine == settings.refine
            && self.settings.cells == settings.cells
            && self.settings.moves == settings.moves
    }

    /// Whether its light goes on as that of a bake with these settings.
    pub fn is_lit_like(&self, settings: &ProbeSettings, net: Option<&[Vec3]>) -> bool {
        let of = &self.settings;
        self.is_placed_like(settings, net)
            && of.n_bounces == settings.n_bounces
            && of.seed == settings.seed
            && of.noise == settings.noise
    }

    /// The bytes of a file: the same for the same probes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER_BYTES + PROBE_BYTES * self.probes.len());
        out.extend(MAGIC);
        let of = &self.settings;
        let (origin, cell, size) = match self.layout {
            BakedLayout::Lattice { origin, cell, size } => (origin, cell, size),
            BakedLayout::Net { .. } => (Vec3::ZERO, 0.0, UVec3::ZERO),
        };
        let numbers = [VERSION, self.probes.len() as u32, size.x, size.y, size.z];
        let floats = [cell, origin.x, origin.y, origin.z].map(f32::to_bits);
        let more = [
            of.cells,
            self.n_paths,
            of.n_bounces,
            of.seed,
            u32::from(of.moves),
            of.noise.to_bits(),
            of.refine.to_bits(),
        ];
        for number in numbers.into_iter().chain(floats).chain(more) {
            out.extend(number.to_le_bytes());
        }
        for number in [self.scene.shape, self.scene.pose, self.scene.light] {
            out.extend(number.to_le_bytes());
        }
        for word in index_of(self).into_iter().flatten() {
            out.extend(word.to_le_bytes());
        }
        out.extend(xxh3_64(&out).to_le_bytes());
        out.extend(bytes_of(&self.probes));
        if let BakedLayout::Net { points } = &self.layout {
            let numbers = points.iter().flat_map(|point| point.to_array());
            numbers.for_each(|number| out.extend(number.to_le_bytes()));
        }
        out.extend(xxh3_64(&out).to_le_bytes());
        out
    }

    /// The probes of a file.
    ///
    /// # Errors
    /// [`BakeError`] other than `Io` and `OtherScene`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, BakeError> {
        let head = Head::of(bytes, bytes.len() as u64)?;
        let (contents, checksum) = bytes.split_at(bytes.len() - CHECKSUM_BYTES);
        if xxh3_64(contents).to_le_bytes() != checksum {
            return Err(BakeError::Damaged);
        }
        let first = head.first_probe as usize;
        let end = first + PROBE_BYTES * head.n_probes as usize;
        let points = words_of(&contents[end..]);
        let mut bake = head.bake;
        if let BakedLayout::Net { points: of } = &mut bake.layout {
            let point = |of: &[u32]| Vec3::from_array([of[0], of[1], of[2]].map(f32::from_bits));
            *of = points.chunks_exact(3).map(point).collect();
        }
        bake.probes = bytemuck::pod_collect_to_vec(&words_of(&contents[first..end]));
        bake.validate()?;
        if index_of(&bake).as_flattened() != words_of(&bytes[HEADER_BYTES..first - CHECKSUM_BYTES])
        {
            return Err(BakeError::Invalid("the index is not that of its probes".into()));
        }
        Ok(bake)
    }

    /// A file with a right checksum can still be wrong: another program wrote it.
    fn validate(&self) -> Result<(), BakeError> {
        let invalid = |what: String| Err(BakeError::Invalid(what));
        if let BakedLayout::Net { points } = &self.layout
            && let Some(ix) = points.iter().position(|point| !point.is_finite())
        {
            return invalid(format!("point {ix} is not finite"));
        }
        let mut last = None;
        for (ix, probe) in self.probes.iter().enumerate() {
            if let BakedLayout::Lattice { size, .. } = self.layout {
                let corner = probe.corner();
                if corner.cmpge(size).any() || probe.corner >> 30 != 0 {
                    return invalid(format!("probe {ix} is at corner {corner} of {size}"));
                }
                let slot = Some(slot_order(&lattice_of(self), corner));
                if slot <= last {
                    return invalid(format!("probe {ix} is out of order"));
                }
                last = slot;
            }
            probe.validate(ix)?;
        }
        Ok(())
    }

    /// Writes a file, completely or not at all.
    ///
    /// # Errors
    /// The system's error.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        write_whole_file(path, |writer| writer.write_all(&self.to_bytes()))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`BakeError`] other than `OtherScene`.
    pub fn read(path: &Path) -> Result<Self, BakeError> {
        Self::from_bytes(&std::fs::read(path)?)
    }

    /// Positions and light as JSON, for other programs:
    ///
    /// ```json
    /// { "units": "…", "lattice": { "origin": [x, y, z], "cell": m, "size": [x, y, z] }, "paths": n,
    ///   "probes": [ { "corner": [x, y, z], "position": [x, y, z], "inside": false, "sh2": [[r, g, b], … nine] } ] }
    /// ```
    ///
    /// A net has neither lattice nor corners.
    pub fn to_json(&self) -> String {
        let lattice = match &self.layout {
            BakedLayout::Lattice { origin, cell, size } => Some(serde_json::json!({
                "origin": origin.to_array(),
                "cell": cell,
                "size": size.to_array(),
            })),
            BakedLayout::Net { .. } => None,
        };
        let of = |(probe, position): (&BakedProbe, Vec3)| {
            let mut json = serde_json::json!({
                "position": position.to_array(),
                "sh2": probe.light().map(|c| c.to_array()),
            });
            if lattice.is_some() {
                json["corner"] = serde_json::json!(probe.corner().to_array());
                json["inside"] = probe.is_inside().into();
            }
            json
        };
        let probes: Vec<_> = self.probes.iter().zip(self.positions()).map(of).collect();
        let mut json = serde_json::json!({
            "units": "metres; sh2: coefficients of incoming radiance [W/sr/m2] that was reflected at least once, real spherical harmonics in the order l*l + l + m, without the Condon-Shortley phase, +Y up",
            "paths": self.n_paths,
            "probes": probes,
        });
        if let Some(lattice) = lattice {
            json["lattice"] = lattice;
        }
        json.to_string()
    }
}

/// What a file begins with.
pub(super) struct Head {
    /// Without probes and points.
    pub bake: ProbeBake,
    pub n_probes: u32,
    /// Where the first probe begins \[bytes\].
    pub first_probe: u64,
}

impl Head {
    /// The head of a file, of which at least the beginning is in `bytes`: up to the probes, or all that there is.
    pub fn of(bytes: &[u8], n_bytes: u64) -> Result<Self, BakeError> {
        if bytes.get(..8) != Some(MAGIC.as_slice()) {
            return Err(BakeError::Foreign);
        }
        let truncated = |expected| BakeError::Truncated { found: n_bytes, expected };
        let least = (HEADER_BYTES + 2 * CHECKSUM_BYTES) as u64;
        let words = words_of(&bytes[8..]);
        let version = *words.first().ok_or(truncated(least))?;
        match version.cmp(&VERSION) {
            Ordering::Greater => return Err(BakeError::Newer(version)),
            Ordering::Less => return Err(BakeError::Older(version)),
            Ordering::Equal => {}
        }
        let Some(
            &[
                _,
                n_probes,
                x,
                y,
                z,
                cell,
                ox,
                oy,
                oz,
                cells,
                n_paths,
                n_bounces,
                seed,
                moves,
                noise,
                refine,
            ],
        ) = words.first_chunk()
        else {
            return Err(truncated(least));
        };
        if n_bytes < least || bytes.len() < HEADER_BYTES {
            return Err(truncated(least));
        }
        let invalid = |what: String| Err(BakeError::Invalid(what));
        let size = UVec3::new(x, y, z);
        let layout = if size == UVec3::ZERO {
            BakedLayout::Net { points: Vec::new() }
        } else {
            let [cell, ox, oy, oz] = [cell, ox, oy, oz].map(f32::from_bits);
            let origin = Vec3::new(ox, oy, oz);
            if size.min_element() < 2 || size.max_element() > MAX_SIZE + 1 {
                return invalid(format!("a lattice of {size} corners"));
            }
            if !(cell > 0.0 && cell.is_finite() && origin.is_finite()) {
                return invalid(format!("cells of {cell} m at {origin}"));
            }
            BakedLayout::Lattice { origin, cell, size }
        };
        let long = |ix: usize| u64::from(words[ix]) | u64::from(words[ix + 1]) << 32;
        let bake = ProbeBake {
            scene: SceneFingerprint { shape: long(16), pose: long(18), light: long(20) },
            settings: settings!(ProbeSettings {
                cells,
                n_paths,
                n_bounces,
                seed,
                moves: moves != 0,
                noise: f32::from_bits(noise),
                refine: f32::from_bits(refine),
            }),
            n_paths,
            layout,
            probes: Vec::new(),
        };
        let of = &bake.settings;
        let is_share = |share: f32| (0.0..=1.0).contains(&share);
        if of.n_bounces == 0 || !is_share(of.noise) || !is_share(of.refine) {
            let (n, noise, refine) = (of.n_bounces, of.noise, of.refine);
            return invalid(format!("{n} bounces, noise {noise}, refine {refine}"));
        }
        let is_net = size == UVec3::ZERO;
        let n_entries = if is_net { 0 } else { n_bricks(&lattice_of(&bake)) as usize };
        let first_probe = HEADER_BYTES + 4 * ENTRY_WORDS * n_entries + CHECKSUM_BYTES;
        let a_probe = PROBE_BYTES + if is_net { POINT_BYTES } else { 0 };
        let expected = (first_probe + CHECKSUM_BYTES) as u64 + a_probe as u64 * u64::from(n_probes);
        if n_bytes < expected || bytes.len() < first_probe {
            return Err(truncated(expected));
        }
        if n_bytes > expected {
            return invalid(format!("it has {n_bytes} bytes, and {expected} are expected"));
        }
        let (contents, checksum) = bytes[..first_probe].split_at(first_probe - CHECKSUM_BYTES);
        if xxh3_64(contents).to_le_bytes() != checksum {
            return Err(BakeError::Damaged);
        }
        Ok(Self { bake, n_probes, first_probe: first_probe as u64 })
    }
}

/// The bytes of probes in a file.
pub(super) fn bytes_of(probes: &[BakedProbe]) -> Vec<u8> {
    bytemuck::cast_slice::<_, u32>(probes).iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// Whole words of bytes in a file.
pub(super) fn words_of(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]])).collect()
}

/// The low half of the hash of some probes' bytes.
pub(super) fn hash_of(bytes: &[u8]) -> u32 {
    xxh3_64(bytes) as u32
}

/// For each brick of the lattice: which of its corners have probes, the first of them, and their hash. Nothing for a net.
fn index_of(bake: &ProbeBake) -> Vec<[u32; ENTRY_WORDS]> {
    let BakedLayout::Lattice { .. } = bake.layout else { return Vec::new() };
    let entry = |[bits, first]: [u32; 2]| {
        let own = first as usize..first as usize + bits.count_ones() as usize;
        [bits, first, hash_of(&bytes_of(&bake.probes[own]))]
    };
    let n = n_bricks(&lattice_of(bake)) as usize;
    structure_of(bake).into_iter().take(n).map(entry).collect()
}

/// The lattice that a bake's probes are on; empty for a net.
pub(super) fn lattice_of(bake: &ProbeBake) -> VoxelGrid {
    let (origin, cell, size) = match bake.layout {
        BakedLayout::Lattice { origin, cell, size } => (origin, cell, size),
        BakedLayout::Net { .. } => (Vec3::ZERO, 1.0, UVec3::ONE),
    };
    VoxelGrid {
        origin,
        cell,
        size,
        n_faces: MAP_SIDE * MAP_SIDE,
        bricks: (size + BRICK - 1) / BRICK,
        capacity: bake.probes.len().max(1) as u32,
    }
}

/// What slots are ordered by: brick, then bit.
fn slot_order(lattice: &VoxelGrid, corner: UVec3) -> u32 {
    let brick = corner / BRICK;
    let inside = corner % BRICK;
    let brick = (brick.z * lattice.bricks.y + brick.y) * lattice.bricks.x + brick.x;
    let bit = (inside.z * BRICK.y + inside.y) * BRICK.x + inside.x;
    brick * 32 + bit
}

/// The words of the structure (`wgsl/components/voxels/bricks.wgsl`) of a bake's probes.
pub(super) fn structure_of(bake: &ProbeBake) -> Vec<[u32; 2]> {
    let lattice = lattice_of(bake);
    let mut bits = vec![0u32; n_bricks(&lattice) as usize];
    for probe in &bake.probes {
        let order = slot_order(&lattice, probe.corner());
        bits[(order / 32) as usize] |= 1 << (order % 32);
    }
    let mut first = 0;
    let mut out = Vec::with_capacity(bits.len() + bake.probes.len());
    for bits in bits {
        out.push([bits, first]);
        first += bits.count_ones();
    }
    out.extend(bake.probes.iter().map(|probe| [probe.corner, probe.place]));
    out
}
