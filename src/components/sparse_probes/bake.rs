// SPDX-License-Identifier: MIT OR Apache-2.0
//! Bakes of sparse probes as files.
//!
//! All numbers are little-endian, and all parts are whole words of 4 bytes:
//!
//! | words | what |
//! |---|---|
//! | 2 | `LUCSPARS` |
//! | 1 | the version of the format, 3 |
//! | 1 | words of the head |
//! | 2 | the part of a divided bake, and how many there are: 0 of 1 if it is not divided |
//! | 6 | the scene's fingerprint: shape, pose, light |
//! | 15 | settings |
//! | 2, 1 | size of the lightmap \[texels\], texels per metre (f32) |
//! | 1 | the radius within which probes count for most receivers \[m, f32\] |
//! | 2 | a hash of the places that probes were given; 0: none were |
//! | 2 | samples of coverage, and those that no probe sees |
//! | 4 | numbers of triangles, probes, receivers, clusters |
//! | 6 a triangle | its corners' places in the lightmap \[texels, f32\] |
//! | 3 a probe | its place \[m, f32\] |
//! | `n_directions` a probe | what it sees |
//! | 4 a receiver | triangle, weights, texel, side |
//! | 1 a receiver | the radius within which probes count \[m, f32\] |
//! | 1 a receiver | which points and neighbours it has ([`SparsePlan::reach`]) |
//! | 1 a cluster, and 1 | where its receivers begin |
//! | 2 | XXH3 (64 bits) of everything before |
//! | … a cluster | [`BakedCluster`], in the order of their numbers |
//!
//! A file of an unfinished bake is the same, with clusters in any order.

use super::plan::{Receiver, SparsePlan, hash_of_places};
use super::settings::{N_WORDS, Numbers, SparseSettings};
use crate::bindings::lucerna::components::sparse_probes::seen::SEEN_UNKNOWN;
use crate::picture::write_whole_file;
use crate::scene::SceneFingerprint;
use glam::{UVec2, Vec2, Vec3};
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;
use xxhash_rust::xxh3::xxh3_64;

const MAGIC: [u32; 2] = [u32::from_le_bytes(*b"LUCS"), u32::from_le_bytes(*b"PARS")];
const VERSION: u32 = 3;
/// Words before the lists.
const FIXED_WORDS: usize = 6 + 6 + N_WORDS + 3 + 1 + 2 + 2 + 4;
const CHECKSUM_WORDS: usize = 2;
/// Words before the lists of a cluster.
const CLUSTER_WORDS: usize = 10;
/// Receivers whose numbers of U_c stand side by side.
pub const BLOCK: usize = crate::bindings::kernels::sparse_probes::receive::WORKGROUP as usize;

/// The transport of a cluster's receivers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedCluster {
    /// Its number in the plan.
    pub ix: u32,
    /// Receivers.
    pub n_receivers: u32,
    /// Vectors that are kept.
    pub n_vectors: u32,
    /// Share of the matrix's sum of squares that is kept.
    pub energy: f32,
    /// Samples of receivers at least half of whose samples a probe sees.
    pub n_samples: u64,
    /// Those of them that a probe sees.
    pub n_valid: u64,
    /// The other receivers: inside of things, or in corners.
    pub n_hidden: u32,
    /// The probes that count in it.
    pub probes: Vec<u32>,
    /// Rows of Σ_c Vᵀ in whole words: two halfs each; or what the row is multiplied by (f32), then four bytes each.
    pub projection: Vec<u32>,
    /// For each output, for each block of 64 receivers, for each two columns of U_c a word of two halfs for each receiver; or for each four a word of
    /// four bytes.
    pub reconstruction: Vec<u32>,
}

/// A bake of sparse probes.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseBake {
    /// What it is of.
    pub plan: SparsePlan,
    /// The part of a divided bake, and how many there are: 0 of 1 if it is not divided.
    pub shard: [u32; 2],
    /// The clusters that are there, in the order of their numbers.
    pub clusters: Vec<BakedCluster>,
}

/// A file of sparse probes cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SparseError {
    /// The system's error.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is something else.
    #[error("it is not a file of sparse probes (it does not begin with LUCSPARS)")]
    Foreign,
    /// Another version wrote it.
    #[error(
        "it has version {0} of the format, and this program reads version {VERSION}: bake again, or use the lucerna that wrote it"
    )]
    Version(u32),
    /// A part is missing.
    #[error("it is truncated at byte {0}; bake again")]
    Truncated(u64),
    /// It has changed since it was written.
    #[error("it is damaged: {0} does not have its checksum; bake again")]
    Damaged(String),
    /// Numbers are not possible.
    #[error("it is not valid: {0}")]
    Invalid(String),
    /// It belongs to another scene.
    #[error(
        "it was baked for another scene: its meshes, or which of them are placed, are different, or things have moved"
    )]
    OtherScene,
    /// Clusters are missing.
    #[error("it is not complete: {missing} of {all} clusters are missing{}", shards_text(.shards))]
    Incomplete {
        /// How many.
        missing: usize,
        /// Of how many.
        all: usize,
        /// The parts of a divided bake that have them, if it is one.
        shards: Vec<String>,
    },
    /// Parts of different bakes.
    #[error("{0} is a part of another bake: scene, settings, probes or texture coordinates differ")]
    OtherPart(String),
}

fn shards_text(shards: &[String]) -> String {
    if shards.is_empty() {
        return ": run the same bake again, and it goes on".into();
    }
    format!(", those of --shard {}: bake them, and merge again", shards.join(", "))
}

/// Whether cluster `ix` belongs to a part of a divided bake.
pub fn is_in_shard(ix: usize, [part, n]: [u32; 2]) -> bool {
    ix % n.max(1) as usize == part as usize
}

impl SparseBake {
    /// A bake that has no clusters yet.
    pub fn begun(plan: SparsePlan, shard: [u32; 2]) -> Self {
        Self { plan, shard, clusters: Vec::new() }
    }

    /// The clusters of its part that are not there.
    pub fn missing(&self) -> Vec<usize> {
        let mut is_there = vec![false; self.plan.n_clusters()];
        self.clusters.iter().for_each(|of| is_there[of.ix as usize] = true);
        (0..is_there.len()).filter(|ix| is_in_shard(*ix, self.shard) && !is_there[*ix]).collect()
    }

    /// The clusters whose receivers see something for the most part: the others are inside of things, and nobody sees how well they are kept.
    pub fn seen_clusters(&self) -> impl Iterator<Item = &BakedCluster> {
        self.clusters.iter().filter(|of| 2 * of.n_hidden < of.n_receivers)
    }

    /// Fails if clusters are missing.
    ///
    /// # Errors
    /// [`SparseError::Incomplete`]
    pub fn check_complete(&self) -> Result<(), SparseError> {
        let all = self.plan.n_clusters();
        if self.clusters.len() == all {
            return Ok(());
        }
        let [part, n] = self.shard;
        // (Of a part, all others are missing.)
        let shards = (0..n).filter(|k| n > 1 && *k != part).map(|k| format!("{k}/{n}")).collect();
        Err(SparseError::Incomplete { missing: all - self.clusters.len(), all, shards })
    }

    /// Whether it goes on as a bake of this scene with these settings. `placed`: the places that probes are given, if they are.
    pub fn goes_on_as(
        &self,
        scene: &SceneFingerprint,
        settings: &SparseSettings,
        shard: [u32; 2],
        placed: Option<&[Vec3]>,
    ) -> bool {
        self.check(scene).is_ok()
            && self.plan.settings == *settings
            && self.shard == shard
            && self.plan.placed == placed.map_or(0, hash_of_places)
    }

    /// What has changed in a scene since it was baked.
    ///
    /// # Errors
    /// [`SparseError::OtherScene`]: surfaces are other ones, or are at other places.
    pub fn check(&self, scene: &SceneFingerprint) -> Result<(), SparseError> {
        let own = &self.plan.scene;
        if own.shape != scene.shape || own.pose != scene.pose {
            return Err(SparseError::OtherScene);
        }
        Ok(())
    }

    /// The head of a file: everything but the clusters.
    pub fn head(&self) -> Vec<u32> {
        let plan = &self.plan;
        let two = |x: u64| [x as u32, (x >> 32) as u32];
        let mut out = Vec::new();
        out.extend(MAGIC);
        out.extend([VERSION, 0]);
        out.extend(self.shard);
        out.extend([plan.scene.shape, plan.scene.pose, plan.scene.light].into_iter().flat_map(two));
        out.extend(plan.settings.words());
        out.extend([plan.size.x, plan.size.y, plan.texels_per_metre.to_bits()]);
        out.push(plan.radius.to_bits());
        out.extend(two(plan.placed));
        out.extend(plan.coverage);
        let counts =
            [plan.corners.len(), plan.probes.len(), plan.receivers.len(), plan.n_clusters()];
        out.extend(counts.map(|n| n as u32));
        out.extend(plan.corners.iter().flatten().flat_map(|at| at.to_array().map(f32::to_bits)));
        out.extend(plan.probes.iter().flat_map(|at| at.to_array().map(f32::to_bits)));
        out.extend(&plan.seen);
        out.extend_from_slice(bytemuck::cast_slice(&plan.receivers));
        out.extend(plan.radii.iter().map(|radius| radius.to_bits()));
        out.extend(&plan.reach);
        out.extend(&plan.clusters);
        out[3] = (out.len() + CHECKSUM_WORDS) as u32;
        out.extend(two(xxh3_64(&bytes_of(&out))));
        out
    }

    /// The bytes of a file: the same for the same bake.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = bytes_of(&self.head()).into_owned();
        self.clusters.iter().for_each(|of| out.extend_from_slice(&bytes_of(&of.words())));
        out
    }

    /// The bake of a file. `is_whole`: false if it may end within a cluster, which is left out then: it was being written.
    ///
    /// # Errors
    /// [`SparseError`] other than `Io`, `OtherScene`, `Incomplete` and `OtherPart`.
    pub fn from_bytes(bytes: &[u8], is_whole: bool) -> Result<Self, SparseError> {
        let words = words_of(bytes);
        let end = bytes.len() as u64;
        if words.len() < 4 || words[..2] != MAGIC {
            return Err(SparseError::Foreign);
        }
        if words[2] != VERSION {
            return Err(SparseError::Version(words[2]));
        }
        let n_head = words[3] as usize;
        if n_head < FIXED_WORDS + CHECKSUM_WORDS {
            return Err(SparseError::Invalid("its head is too short".into()));
        }
        let head = words.get(..n_head).ok_or(SparseError::Truncated(end))?;
        check_sum(head, || "the head".into())?;
        let (plan, shard) = plan_of(&head[..n_head - CHECKSUM_WORDS])?;
        let mut out = Self::begun(plan, shard);
        let mut rest = &words[n_head..];
        while !rest.is_empty() {
            let n = rest.first().map_or(0, |n| *n as usize);
            let Some(record) = rest.get(..n).filter(|_| n > CLUSTER_WORDS) else {
                if is_whole {
                    return Err(SparseError::Truncated(end));
                }
                break;
            };
            let cluster = match cluster_of(record, &out.plan) {
                Ok(cluster) => cluster,
                Err(_) if !is_whole => break,
                Err(error) => return Err(error),
            };
            out.clusters.push(cluster);
            rest = &rest[n..];
        }
        if is_whole && !bytes.len().is_multiple_of(4) {
            return Err(SparseError::Truncated(end));
        }
        out.clusters.sort_by_key(|cluster| cluster.ix);
        let is_twice = |two: &[BakedCluster]| two[0].ix == two[1].ix;
        if out.clusters.windows(2).any(is_twice) {
            return Err(SparseError::Invalid("a cluster is there twice".into()));
        }
        Ok(out)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`Self::from_bytes`], and `Io`.
    pub fn read(path: &Path, is_whole: bool) -> Result<Self, SparseError> {
        let file = std::fs::File::open(path)?;
        if file.metadata()?.len() == 0 {
            return Err(SparseError::Foreign);
        }
        // SAFETY: the file is only read. If another program shortens it meanwhile, reading fails by a signal; that is the price of not having it in
        // memory twice.
        let map = unsafe { memmap2::Mmap::map(&file)? };
        Self::from_bytes(&map, is_whole)
    }

    /// Writes a file, completely or not at all.
    ///
    /// # Errors
    /// The system's error.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        write_whole_file(path, |writer| {
            writer.write_all(&bytes_of(&self.head()))?;
            self.clusters.iter().try_for_each(|of| writer.write_all(&bytes_of(&of.words())))
        })
    }

    /// Joins the parts of a divided bake to the same bytes as one without division. Names are for messages.
    ///
    /// # Errors
    /// [`SparseError::OtherPart`], or [`SparseError::Incomplete`] with the parts that are missing.
    pub fn merge(parts: Vec<(String, Self)>) -> Result<Self, SparseError> {
        let mut parts = parts.into_iter();
        let Some((_, mut out)) = parts.next() else {
            return Err(SparseError::Invalid("there are no parts".into()));
        };
        let n = out.shard[1];
        for (name, part) in parts {
            if part.plan != out.plan || part.shard[1] != n {
                return Err(SparseError::OtherPart(name));
            }
            // (The same part may be given twice.)
            for cluster in part.clusters {
                if !out.clusters.iter().any(|of| of.ix == cluster.ix) {
                    out.clusters.push(cluster);
                }
            }
        }
        out.clusters.sort_by_key(|cluster| cluster.ix);
        let all = out.plan.n_clusters();
        if out.clusters.len() < all {
            let mut is_there = vec![false; all];
            out.clusters.iter().for_each(|of| is_there[of.ix as usize] = true);
            let lacks =
                |part: &u32| (0..all).any(|ix| is_in_shard(ix, [*part, n]) && !is_there[ix]);
            let shards = (0..n).filter(lacks).map(|k| format!("{k}/{n}")).collect();
            return Err(SparseError::Incomplete { missing: all - out.clusters.len(), all, shards });
        }
        out.shard = [0, 1];
        Ok(out)
    }
}

impl BakedCluster {
    /// As a file has it: its length, numbers, lists, and the checksum of all before \[words\].
    pub fn words(&self) -> Vec<u32> {
        let two = |x: u64| [x as u32, (x >> 32) as u32];
        let mut out = vec![0, self.ix, self.n_receivers, self.n_vectors, self.energy.to_bits()];
        out.extend(two(self.n_samples));
        out.extend(two(self.n_valid));
        out.extend([self.n_hidden, self.probes.len() as u32]);
        out.extend(&self.probes);
        out.extend(&self.projection);
        out.extend(&self.reconstruction);
        out[0] = (out.len() + CHECKSUM_WORDS) as u32;
        out.extend(two(xxh3_64(&bytes_of(&out))));
        out
    }

    /// Words of a row of Σ_c Vᵀ.
    pub fn words_of_row(&self, settings: &SparseSettings) -> usize {
        let n_columns = self.probes.len() * settings.n_coefficients() as usize;
        match settings.numbers {
            Numbers::Halfs => n_columns.div_ceil(2),
            Numbers::Bytes => 1 + n_columns.div_ceil(4),
        }
    }
}

/// A file's bytes of some words: these themselves, on machines that are little-endian.
fn bytes_of(words: &[u32]) -> Cow<'_, [u8]> {
    if cfg!(target_endian = "little") {
        return bytemuck::cast_slice(words).into();
    }
    words.iter().flat_map(|word| word.to_le_bytes()).collect()
}

/// The whole words of a file's bytes, likewise, if they are where words may be.
fn words_of(bytes: &[u8]) -> Cow<'_, [u32]> {
    let words = bytes.as_chunks::<4>().0;
    match bytemuck::try_cast_slice(words.as_flattened()) {
        Ok(words) if cfg!(target_endian = "little") => words.into(),
        _ => words.iter().map(|word| u32::from_le_bytes(*word)).collect(),
    }
}

fn check_sum(words: &[u32], what: impl Fn() -> String) -> Result<(), SparseError> {
    let (contents, sum) = words.split_at(words.len() - CHECKSUM_WORDS);
    let known = u64::from(sum[0]) | u64::from(sum[1]) << 32;
    if xxh3_64(&bytes_of(contents)) == known { Ok(()) } else { Err(SparseError::Damaged(what())) }
}

/// Takes words from the front of a list.
struct Words<'a>(&'a [u32]);

impl<'a> Words<'a> {
    fn take(&mut self, n: usize) -> Result<&'a [u32], SparseError> {
        let missing = || SparseError::Invalid("its lists do not fit into its head".into());
        let (front, rest) = self.0.split_at_checked(n).ok_or_else(missing)?;
        self.0 = rest;
        Ok(front)
    }

    fn array<const N: usize>(&mut self) -> Result<[u32; N], SparseError> {
        let taken = self.take(N)?;
        Ok(std::array::from_fn(|ix| taken[ix]))
    }

    fn long(&mut self) -> Result<u64, SparseError> {
        let [low, high] = self.array()?;
        Ok(u64::from(low) | u64::from(high) << 32)
    }
}

/// The plan of a head without its checksum.
fn plan_of(head: &[u32]) -> Result<(SparsePlan, [u32; 2]), SparseError> {
    let invalid = |what: &str| SparseError::Invalid(what.into());
    let mut words = Words(&head[4..]);
    let shard: [u32; 2] = words.array()?;
    if shard[0] >= shard[1] {
        return Err(invalid("its part of a divided bake is not possible"));
    }
    let scene =
        SceneFingerprint { shape: words.long()?, pose: words.long()?, light: words.long()? };
    let settings = SparseSettings::of_words(words.array()?);
    let settings = settings.ok_or_else(|| invalid("its settings are not possible"))?;
    let [width, height, density] = words.array()?;
    let size = UVec2::new(width, height);
    let [radius] = words.array()?;
    let placed = words.long()?;
    let coverage = words.array()?;
    let [n_triangles, n_probes, n_receivers, n_clusters] = words.array()?.map(|n: u32| n as usize);
    let float = |word: &u32| f32::from_bits(*word);
    let floats = |words: &[u32]| -> Vec<f32> { words.iter().map(float).collect() };
    let corners = floats(words.take(6 * n_triangles)?);
    let probes = floats(words.take(3 * n_probes)?);
    let seen = words.take(n_probes * settings.n_directions as usize)?.to_vec();
    let receivers: Vec<Receiver> = bytemuck::cast_slice(words.take(4 * n_receivers)?).to_vec();
    let radii = floats(words.take(n_receivers)?);
    let reach = words.take(n_receivers)?.to_vec();
    let clusters = words.take(n_clusters + 1)?.to_vec();
    if !words.0.is_empty() {
        return Err(invalid("its head is too long"));
    }
    let all_finite = |floats: &[f32]| floats.iter().all(|x| x.is_finite());
    if size.min_element() == 0 || size.max_element() > 1 << 14 {
        return Err(invalid("the size of its lightmap is not possible"));
    }
    if !all_finite(&corners) || !all_finite(&probes) || !all_finite(&radii) {
        return Err(invalid("numbers are not finite"));
    }
    let is_outside = |of: &&Receiver| {
        (of.texel & 0xffff) >= size.x
            || (of.texel >> 16) >= size.y
            || of.side > 1
            || of.triangle as usize >= n_triangles
    };
    if receivers.iter().find(is_outside).is_some() {
        return Err(invalid("a receiver is outside the lightmap"));
    }
    if seen.iter().any(|what| *what < SEEN_UNKNOWN && *what as usize >= n_receivers) {
        return Err(invalid("a probe sees a receiver that is not there"));
    }
    let rises = clusters.windows(2).all(|two| two[0] < two[1]);
    if !rises || clusters[0] != 0 || clusters[n_clusters] as usize != n_receivers {
        return Err(invalid("its clusters do not have all receivers"));
    }
    let plan = SparsePlan {
        scene,
        settings,
        radius: f32::from_bits(radius),
        placed,
        size,
        texels_per_metre: f32::from_bits(density),
        corners: corners
            .as_chunks::<6>()
            .0
            .iter()
            .map(|of| std::array::from_fn(|k| Vec2::new(of[2 * k], of[2 * k + 1])))
            .collect(),
        probes: probes.as_chunks::<3>().0.iter().map(|of| Vec3::from_array(*of)).collect(),
        receivers,
        radii,
        reach,
        clusters,
        seen,
        coverage,
    };
    Ok((plan, shard))
}

/// The cluster of a record.
fn cluster_of(record: &[u32], plan: &SparsePlan) -> Result<BakedCluster, SparseError> {
    let name = || format!("cluster {}", record[1]);
    check_sum(record, name)?;
    let mut words = Words(&record[1..record.len() - CHECKSUM_WORDS]);
    let [ix, n_receivers, n_vectors, energy] = words.array()?;
    let mut out = BakedCluster {
        ix,
        n_receivers,
        n_vectors,
        energy: f32::from_bits(energy),
        n_samples: words.long()?,
        n_valid: words.long()?,
        ..BakedCluster::default()
    };
    let [n_hidden, n_probes] = words.array()?;
    out.n_hidden = n_hidden;
    let invalid = |what: &str| SparseError::Invalid(format!("{}: {what}", name()));
    if ix as usize >= plan.n_clusters() {
        return Err(invalid("there are not as many"));
    }
    if plan.receivers_of(ix as usize).len() != n_receivers as usize {
        return Err(invalid("it has another number of receivers than its plan"));
    }
    if n_vectors > plan.settings.n_vectors {
        return Err(invalid("it has more vectors than its settings say"));
    }
    out.probes = words.take(n_probes as usize)?.to_vec();
    if out.probes.iter().any(|probe| *probe as usize >= plan.probes.len()) {
        return Err(invalid("it has a probe that is not there"));
    }
    let row = out.words_of_row(&plan.settings);
    out.projection = words.take(row * n_vectors as usize)?.to_vec();
    let blocks = (n_receivers as usize).div_ceil(BLOCK) * plan.settings.n_outputs() as usize;
    let n_words = (n_vectors as usize).div_ceil(plan.settings.numbers.in_word()) * BLOCK * blocks;
    out.reconstruction = words.take(n_words)?.to_vec();
    if !words.0.is_empty() {
        return Err(invalid("it is too long"));
    }
    // (Infinity and NaN have all bits of the exponent.)
    let is_finite = |two: &u32| [two >> 10 & 31, two >> 26 & 31].iter().all(|bits| *bits != 31);
    let is_possible = match plan.settings.numbers {
        Numbers::Halfs => out.projection.iter().chain(&out.reconstruction).all(is_finite),
        Numbers::Bytes => out
            .projection
            .iter()
            .step_by(row.max(1))
            .all(|scale| f32::from_bits(*scale).is_finite()),
    };
    if !is_possible {
        return Err(invalid("numbers are not finite"));
    }
    Ok(out)
}
