// SPDX-License-Identifier: MIT OR Apache-2.0
//! Baked probes of which only those around a place are in memory.
//!
//! ```text
//! ProbeFile ──index──▶ which bricks are nearest ──▶ load, drop ──▶ bricks' words, places, distances, gathered light of a pool
//!  a file                                            free ranges of the pool's slots
//! ```
//!
//! A brick's word says where its probes begin in the pool, so nothing moves when others come and go. Look-ups are those of any lattice:
//! a corner of a brick that is not there has no probe.

use super::bake::{
    BakeError, BakedLayout, BakedProbe, CHECKSUM_BYTES, ENTRY_WORDS, HEADER_BYTES, Head,
    PROBE_BYTES, ProbeBake, hash_of, lattice_of, words_of,
};
use crate::components::voxels::{BRICK, VoxelGrid, n_bricks};
use glam::{UVec3, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// A file of baked probes on a lattice, of which only the index is in memory: 12 bytes for each brick of 4 × 4 × 2 corners.
#[derive(Debug)]
pub struct ProbeFile {
    file: File,
    head: ProbeBake,
    first_probe: u64,
    index: Vec<[u32; ENTRY_WORDS]>,
    /// Of the header and the index.
    hash: u32,
}

impl ProbeFile {
    /// Opens a file that [`ProbeBake::write`] has written, and reads its index.
    ///
    /// # Errors
    /// [`BakeError`] other than `OtherScene`.
    pub fn open(path: &Path) -> Result<Self, BakeError> {
        let mut file = File::open(path)?;
        let n_bytes = file.metadata()?.len();
        // The header tells how long the index is.
        let mut bytes = vec![0; (HEADER_BYTES as u64).min(n_bytes) as usize];
        file.read_exact(&mut bytes)?;
        let size = words_of(bytes.get(16..28).unwrap_or_default());
        let most = crate::components::voxels::MAX_SIZE + 1;
        if size.iter().all(|n| (1..=most).contains(n)) && size.len() == 3 {
            let size = UVec3::new(size[0], size[1], size[2]);
            let n = ((size + BRICK - 1) / BRICK).element_product() as usize;
            let rest = (4 * ENTRY_WORDS * n + CHECKSUM_BYTES) as u64;
            (&mut file).take(rest).read_to_end(&mut bytes)?;
        } else {
            (&mut file).take(CHECKSUM_BYTES as u64).read_to_end(&mut bytes)?;
        }
        let head = Head::of(&bytes, n_bytes)?;
        let BakedLayout::Lattice { .. } = head.bake.layout else {
            return Err(BakeError::Invalid(
                "only a lattice can be read in parts, and it is a net".into(),
            ));
        };
        let words = words_of(&bytes[HEADER_BYTES..head.first_probe as usize - CHECKSUM_BYTES]);
        let index: Vec<[u32; ENTRY_WORDS]> =
            words.chunks_exact(ENTRY_WORDS).map(|w| [w[0], w[1], w[2]]).collect();
        let mut n = 0;
        for [bits, first, _] in &index {
            if *first != n {
                return Err(BakeError::Invalid("the index is out of order".into()));
            }
            n += bits.count_ones();
        }
        if n != head.n_probes {
            let n_probes = head.n_probes;
            return Err(BakeError::Invalid(format!(
                "{n} probes in the index, {n_probes} in the header"
            )));
        }
        let hash = hash_of(&bytes);
        let made = Self { file, head: head.bake, first_probe: head.first_probe, index, hash };
        for (brick, [bits, ..]) in made.index.iter().enumerate() {
            let size = lattice_of(&made.head).size;
            if made.corners(brick as u32, *bits).any(|corner| corner.cmpge(size).any()) {
                return Err(BakeError::Invalid(format!(
                    "brick {brick} has a corner outside the lattice"
                )));
            }
        }
        Ok(made)
    }

    /// Everything but the probes: the scene, the settings, the lattice.
    pub fn head(&self) -> &ProbeBake {
        &self.head
    }

    /// How many probes it has.
    pub fn n_probes(&self) -> u32 {
        self.index.iter().map(|[bits, ..]| bits.count_ones()).sum()
    }

    /// The lattice, with room for `capacity` probes.
    pub(super) fn lattice(&self, capacity: u32) -> VoxelGrid {
        VoxelGrid { capacity, ..lattice_of(&self.head) }
    }

    /// The corners of a brick's bits, in order.
    fn corners(&self, brick: u32, bits: u32) -> impl Iterator<Item = UVec3> {
        let UVec3 { x, y, .. } = lattice_of(&self.head).bricks;
        let low = UVec3::new(brick % x, brick / x % y, brick / (x * y)) * BRICK;
        let inside = |bit: u32| {
            UVec3::new(bit % BRICK.x, bit / BRICK.x % BRICK.y, bit / (BRICK.x * BRICK.y))
        };
        (0..32).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| low + inside(bit))
    }

    /// The probes of a brick.
    fn read(&mut self, brick: u32) -> Result<Vec<BakedProbe>, BakeError> {
        let [bits, first, hash] = self.index[brick as usize];
        let at = self.first_probe + PROBE_BYTES as u64 * u64::from(first);
        self.file.seek(SeekFrom::Start(at))?;
        let mut bytes = vec![0; PROBE_BYTES * bits.count_ones() as usize];
        self.file.read_exact(&mut bytes)?;
        if hash_of(&bytes) != hash {
            return Err(BakeError::Damaged);
        }
        let probes: Vec<BakedProbe> = bytemuck::pod_collect_to_vec(&words_of(&bytes));
        probes
            .iter()
            .enumerate()
            .try_for_each(|(ix, probe)| probe.validate(first as usize + ix))?;
        Ok(probes)
    }
}

/// What [`Probes::stream`](super::Probes::stream) did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Streamed {
    /// Bricks that were loaded.
    pub n_loaded: u32,
    /// Bricks that were dropped.
    pub n_dropped: u32,
    /// Bricks within the radius that are not there yet, because this call loads no more.
    pub n_to_load: u32,
    /// All bricks nearer than this have their probes, or will once they are loaded \[m\]; infinite if the pool has room for all.
    pub radius: f32,
}

/// Which bricks are in the pool, and where.
#[derive(Debug)]
pub(super) struct Pool {
    /// The hash of its file's header and index.
    of: u32,
    /// The first slot of a brick that is there, its number of slots, and how many of them were moved and are inside something.
    present: BTreeMap<u32, (u32, u32, [u32; 2])>,
    /// Free ranges: the first slot, and how many.
    free: BTreeMap<u32, u32>,
    /// How many were moved, and are inside something.
    pub placed: [u32; 2],
    /// Of the last call.
    pub n_to_load: u32,
    pub radius: f32,
}

/// A brick that came or went.
pub(super) enum Change {
    Loaded { brick: u32, bits: u32, first: u32, probes: Vec<BakedProbe> },
    Dropped { brick: u32 },
}

impl Pool {
    pub fn new(file: &ProbeFile, capacity: u32) -> Self {
        Self {
            of: file.hash,
            present: BTreeMap::new(),
            free: BTreeMap::from([(0, capacity)]),
            placed: [0, 0],
            n_to_load: 0,
            radius: 0.0,
        }
    }

    /// Fails if a file is not the one that the pool was made for.
    pub fn check(&self, file: &ProbeFile) -> Result<(), BakeError> {
        if self.of == file.hash {
            return Ok(());
        }
        Err(BakeError::Invalid("it is not the file that these probes are of".into()))
    }

    /// Probes that are there.
    pub fn n_probes(&self) -> u32 {
        self.present.values().map(|(_, n, _)| n).sum()
    }

    /// The first range that is large enough; None if there is none.
    fn take(&mut self, n: u32) -> Option<u32> {
        let (&first, &room) = self.free.iter().find(|(_, room)| **room >= n)?;
        self.free.remove(&first);
        if room > n {
            self.free.insert(first + n, room - n);
        }
        Some(first)
    }

    fn give_back(&mut self, mut first: u32, mut n: u32) {
        if let Some((&before, &room)) = self.free.range(..first).next_back()
            && before + room == first
        {
            self.free.remove(&before);
            (first, n) = (before, n + room);
        }
        if let Some(room) = self.free.remove(&(first + n)) {
            n += room;
        }
        self.free.insert(first, n);
    }

    fn drop_brick(&mut self, brick: u32, changes: &mut Vec<Change>) {
        if let Some((first, n, placed)) = self.present.remove(&brick) {
            self.give_back(first, n);
            (0..2).for_each(|k| self.placed[k] -= placed[k]);
            changes.push(Change::Dropped { brick });
        }
    }

    /// Chooses the bricks nearest to `center` that there is room for, loads at most `most` of those that are not there (the nearest first), and
    /// drops those that are not among them. What has changed is valid also if a brick could not be read.
    pub fn follow(
        &mut self,
        file: &mut ProbeFile,
        center: Vec3,
        most: u32,
    ) -> (Vec<Change>, Result<Streamed, BakeError>) {
        let grid = lattice_of(&file.head);
        let capacity: u32 =
            self.free.values().chain(self.present.values().map(|(_, n, _)| n)).sum();
        let at = (center - grid.origin) / grid.cell;
        let mut bricks: Vec<(f32, u32)> = (0..n_bricks(&grid))
            .filter(|brick| file.index[*brick as usize][0] != 0)
            .map(|brick| {
                let (x, y) = (grid.bricks.x, grid.bricks.y);
                let low = (UVec3::new(brick % x, brick / x % y, brick / (x * y)) * BRICK).as_vec3();
                // (A corner of a wide cell stands for what is up to four cells away.)
                let apart = at - at.clamp(low - 4.0, low + BRICK.as_vec3() + 3.0);
                (apart.length() * grid.cell, brick)
            })
            .collect();
        bricks.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let n_of = |brick: u32| file.index[brick as usize][0].count_ones();
        let mut room = capacity;
        let fits = |(_, brick): &&(f32, u32)| {
            let fits = n_of(*brick) <= room;
            room = room.saturating_sub(n_of(*brick));
            fits
        };
        let wanted: Vec<(f32, u32)> = bricks.iter().take_while(fits).copied().collect();
        let mut radius = bricks.get(wanted.len()).map_or(f32::INFINITY, |(apart, _)| *apart);
        let mut changes = Vec::new();
        let is_wanted: std::collections::HashSet<u32> = wanted.iter().map(|of| of.1).collect();
        let gone: Vec<u32> =
            self.present.keys().copied().filter(|brick| !is_wanted.contains(brick)).collect();
        gone.iter().for_each(|brick| self.drop_brick(*brick, &mut changes));
        let apart_of: HashMap<u32, f32> =
            bricks.iter().map(|(apart, brick)| (*brick, *apart)).collect();
        let (mut n_loaded, mut n_to_load, mut failed) = (0, 0, None);
        let mut n_dropped = gone.len() as u32;
        for (apart, brick) in wanted {
            if self.present.contains_key(&brick) {
                continue;
            }
            if n_loaded == most {
                n_to_load += 1;
                continue;
            }
            let probes = match file.read(brick) {
                Ok(probes) => probes,
                Err(error) => {
                    failed.get_or_insert(error);
                    n_to_load += 1;
                    radius = radius.min(apart);
                    continue;
                }
            };
            // (Free slots are in pieces: the farthest bricks make room.)
            let n = probes.len() as u32;
            let first = loop {
                if let Some(first) = self.take(n) {
                    break Some(first);
                }
                let distance = |brick: &u32| apart_of.get(brick).copied().unwrap_or(f32::INFINITY);
                let farthest = self
                    .present
                    .keys()
                    .copied()
                    .max_by(|a, b| distance(a).total_cmp(&distance(b)).then(a.cmp(b)));
                match farthest.filter(|brick| distance(brick) > apart) {
                    Some(brick) => {
                        self.drop_brick(brick, &mut changes);
                        radius = radius.min(distance(&brick));
                        n_dropped += 1;
                    }
                    None => break None,
                }
            };
            // (What is farther away does not come either: the next call would only drop it again.)
            let Some(first) = first else {
                radius = radius.min(apart);
                break;
            };
            let count =
                |is: fn(&BakedProbe) -> bool| probes.iter().filter(|of| is(of)).count() as u32;
            let placed = [count(|of| of.moved() != Vec3::ZERO), count(BakedProbe::is_inside)];
            (0..2).for_each(|k| self.placed[k] += placed[k]);
            self.present.insert(brick, (first, n, placed));
            changes.push(Change::Loaded {
                brick,
                bits: file.index[brick as usize][0],
                first,
                probes,
            });
            n_loaded += 1;
        }
        (self.n_to_load, self.radius) = (n_to_load, radius);
        let found = Streamed { n_loaded, n_dropped, n_to_load, radius };
        (changes, failed.map_or(Ok(found), Err))
    }
}
