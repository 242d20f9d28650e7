// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels that go over the records of `voxel-rt`'s cache: carry, walls, publish.

use crate::harness::{Random, assert_each, differing_bytes, gpu, read, submit};
use bytemuck::Zeroable;
use glam::{IVec3, UVec3, Vec3};
use lucerna::components::voxel_light::{
    CacheBuffers, CarryInfo, CarryPass, FaceLight, PublishInfo, PublishPass, VoxelLevel,
    VoxelLevels, WallsInfo, WallsPass, sparse_grid,
};
use lucerna::components::voxels::{RECORD_GROUPS_OFFSET, VOXEL_GROUPS_OFFSET};
use lucerna::components::voxels::{VoxelCounts, VoxelGrid};
use lucerna::gpu::{ComputeRecorder, Dispatch};
use lucerna::settings;
use std::collections::HashMap;

/// Two levels, of which the second one is looked at: everything of it stands behind the first one's.
struct Rig {
    buffers: CacheBuffers,
    grid: VoxelGrid,
    cells: Vec<UVec3>,
    first_word: usize,
    first_record: usize,
    lights: Vec<FaceLight>,
    /// The dispatches of the second level.
    counts: wgpu::Buffer,
}

const SIZE: UVec3 = UVec3::new(9, 7, 5);
/// Slots and records behind the last: more than a workgroup.
const N_GUARDS: usize = 70;
const GUARD: u32 = 0x4bad_4bad;
const LEVEL: u32 = 1;

fn some_cells(random: &mut Random) -> Vec<UVec3> {
    let all = (0..SIZE.element_product())
        .map(|ix| UVec3::new(ix % SIZE.x, ix / SIZE.x % SIZE.y, ix / (SIZE.x * SIZE.y)));
    all.filter(|_| random.unit() < 0.6).collect()
}

fn cells_of(words: &[[u32; 2]]) -> Vec<UVec3> {
    words.iter().map(|&[c, _]| UVec3::new(c & 1023, c >> 10 & 1023, c >> 20)).collect()
}

impl Rig {
    /// `walls`: the second word of each slot.
    fn new(
        random: &mut Random,
        n_faces: u32,
        record: impl Fn(&mut Random) -> FaceLight,
        walls: impl Fn(&mut Random) -> u32,
    ) -> Self {
        let cells = some_cells(random);
        let (grid, mut words) = sparse_grid(Vec3::ZERO, 1.0, SIZE, n_faces, &cells);
        let n_bricks = grid.bricks.element_product() as usize;
        words[n_bricks..].iter_mut().for_each(|word| word[1] = walls(random));
        let (other, other_words) =
            sparse_grid(Vec3::ONE, 2.0, UVec3::splat(4), n_faces, &cells[..9]);
        let (first_word, first_record) = (other_words.len(), (other.capacity * n_faces) as usize);
        let mut layout = VoxelLevels::zeroed();
        layout.n_levels = 2;
        let level = settings!(VoxelLevel { grid: other, ..Zeroable::zeroed() });
        layout.levels[0] = level;
        layout.levels[1] = settings!(VoxelLevel {
            grid,
            first_brick: first_word as u32,
            first_record: first_record as u32,
            ..Zeroable::zeroed()
        });
        let n_slots = words.len() - n_bricks;
        let n_records = first_record + n_slots * n_faces as usize + N_GUARDS;
        let lights: Vec<_> = (0..n_records).map(|_| record(random)).collect();
        let buffers = CacheBuffers::new(
            gpu(),
            &layout,
            (first_word + words.len() + N_GUARDS) as u32,
            n_records as u32,
        )
        .unwrap();
        let all_words = [other_words, words, vec![[GUARD; 2]; N_GUARDS]].concat();
        let end = 16 * (n_records - N_GUARDS) as u64;
        for light in [&buffers.reflected, &buffers.shown] {
            gpu().queue.write_buffer(light, end, bytemuck::cast_slice(&[[GUARD; 4]; N_GUARDS]));
        }
        let counts = settings!(VoxelCounts {
            n_voxels: n_slots as u32,
            n_records: n_slots as u32 * n_faces,
            voxel_groups: UVec3::new((n_slots as u32).div_ceil(64), 1, 1),
            record_groups: UVec3::new((n_slots as u32 * n_faces).div_ceil(64), 1, 1),
            ..Zeroable::zeroed()
        });
        let queue = &gpu().queue;
        queue.write_buffer(&buffers.structure, 0, bytemuck::cast_slice(&all_words));
        queue.write_buffer(&buffers.lights, 0, bytemuck::cast_slice(&lights));
        queue.write_buffer(&buffers.counts[1], 0, &bytemuck::bytes_of(&counts)[..16]);
        let indirect = gpu().device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("test"),
            size: size_of::<VoxelCounts>() as u64,
            usage: wgpu::BufferUsages::INDIRECT | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        queue.write_buffer(&indirect, 0, bytemuck::bytes_of(&counts));
        let cells = cells_of(&all_words[first_word + n_bricks..][..n_slots]);
        Self { buffers, grid, cells, first_word, first_record, lights, counts: indirect }
    }

    /// Runs something, which must change nothing behind the last record and slot.
    fn run(&self, record: impl FnOnce(&mut ComputeRecorder)) {
        let behind = || {
            let of = |buffer: &wgpu::Buffer, bytes: usize| {
                let all = read(buffer);
                all[all.len() - N_GUARDS * bytes..].to_vec()
            };
            let Self { buffers, .. } = self;
            [
                ("structure", of(&buffers.structure, 8)),
                ("lights", of(&buffers.lights, size_of::<FaceLight>())),
                ("reflected", of(&buffers.reflected, 16)),
                ("shown", of(&buffers.shown, 16)),
            ]
        };
        let before = behind();
        submit(|recorder| record(&mut recorder.compute("test")));
        for ((name, before), (_, after)) in before.iter().zip(behind()) {
            let what = differing_bytes(before, &after);
            assert!(*before == after, "{name} behind the last record: {what}");
        }
    }

    fn slots(&self) -> Dispatch<'_> {
        Dispatch::Indirect(&self.counts, VOXEL_GROUPS_OFFSET)
    }

    fn records(&self) -> Dispatch<'_> {
        Dispatch::Indirect(&self.counts, RECORD_GROUPS_OFFSET)
    }

    fn words(&self) -> Vec<[u32; 2]> {
        let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(&self.buffers.structure));
        let first = self.first_word + self.grid.bricks.element_product() as usize;
        words[first..][..self.cells.len()].to_vec()
    }

    fn record_of(&self, slot: usize, face: usize) -> &FaceLight {
        &self.lights[self.first_record + slot * self.grid.n_faces as usize + face]
    }
}

fn random_record(random: &mut Random) -> FaceLight {
    let n_rays = random.range(1.0, 400.0).floor();
    let light = |random: &mut Random| Vec3::new(random.unit(), 10.0 * random.unit(), 0.01);
    FaceLight {
        direct: light(random),
        n_hits: (random.unit() * 1.3 * n_rays).min(n_rays).floor(),
        indirect: light(random),
        n_rays,
        feedback: light(random),
        state: random.bits() as u32,
    }
}

/// In a wall's word, + and − face of axis k are bits 2k and 2k + 1.
fn walled(word: u32, axis: usize, negative: bool) -> bool {
    word >> (2 * axis + usize::from(negative)) & 1 == 1
}

/// What a face publishes, in f64 over a map of cells instead of bricks: the mean of its own record and of
/// those beside it, weighted by ½ an axis, by what of their face a surface covers, a hundredth where a sheet
/// across another axis divides their cell, and not at all behind a wall of the face's own cell; for pictures
/// with less of the neighbours the more hits are its own. Tolerance: sums of 27 f32.
fn publishes(n_faces: u32) {
    let mut random = Random(31);
    let rig = Rig::new(&mut random, n_faces, random_record, |random| random.bits() as u32 & 63);
    let publish = PublishPass::new(gpu());
    let slots: HashMap<IVec3, usize> =
        rig.cells.iter().enumerate().map(|(slot, cell)| (cell.as_ivec3(), slot)).collect();
    let words = rig.words();
    let light_rays = 150.0f32;
    for feedback in [0, 1] {
        let info =
            settings!(PublishInfo { level: LEVEL, feedback, light_rays, ..Zeroable::zeroed() });
        rig.run(|pass| publish.record(pass, &rig.buffers, &info, rig.records()));
        let reflected: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.reflected));
        let shown: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.shown));
        for (what, records) in [("reflected", &reflected), ("shown", &shown)] {
            let what = format!(
                "{n_faces} faces, feedback {feedback}: records of the first level in {what}"
            );
            assert_each(&what, &records[..rig.first_record], "0", |record| *record == [0.0; 4]);
        }
        let (mut n_neighbours, mut n_behind) = (0, 0);
        for (slot, cell) in rig.cells.iter().enumerate() {
            for face in 0..n_faces as usize {
                let coverage =
                    |light: &FaceLight| f64::from(light.n_hits) / f64::from(light.n_rays);
                let own = rig.record_of(slot, face);
                let at = rig.first_record + slot * n_faces as usize + face;
                let covered = coverage(own);
                let hits = f64::from(own.n_hits)
                    * (f64::from(light_rays) / f64::from(own.n_rays)).min(1.0);
                let share = 64.0 / hits.max(64.0);
                let mut sums = [
                    (own.feedback.as_dvec3() * covered, covered),
                    (own.indirect.as_dvec3() * covered, covered),
                ];
                for dz in -1..=1 {
                    for dy in -1..=1 {
                        for dx in -1..=1 {
                            let offset = IVec3::new(dx, dy, dz);
                            let Some(&other) = slots.get(&(cell.as_ivec3() + offset)) else {
                                continue;
                            };
                            let axes = offset.to_array();
                            if offset == IVec3::ZERO || (n_faces == 6 && axes[face / 2] != 0) {
                                continue;
                            }
                            let mut weight = 0.5f64.powi(offset.abs().element_sum());
                            if n_faces == 6 {
                                let behind = (0..3).any(|axis| {
                                    (axes[axis] < 0 && walled(words[slot][1], axis, false))
                                        || (axes[axis] > 0 && walled(words[slot][1], axis, true))
                                });
                                if behind {
                                    n_behind += 1;
                                    continue;
                                }
                                let divided = (0..3).any(|axis| {
                                    axis != face / 2
                                        && walled(words[other][1], axis, false)
                                        && walled(words[other][1], axis, true)
                                });
                                weight *= if divided { 0.01 } else { 1.0 };
                            }
                            n_neighbours += 1;
                            let light = rig.record_of(other, face);
                            weight *= coverage(light);
                            sums[0].0 += weight * light.feedback.as_dvec3();
                            sums[0].1 += weight;
                            sums[1].0 += share * weight * light.indirect.as_dvec3();
                            sums[1].1 += share * weight;
                        }
                    }
                }
                let [again, indirect] = sums.map(|(sum, weight)| sum / weight);
                let again = again * f64::from(feedback);
                let expected = [
                    ("reflected", reflected[at], own.direct.as_dvec3() + again),
                    ("shown", shown[at], indirect),
                ];
                for (what, got, expected) in expected {
                    let what = format!("feedback {feedback}, cell {cell}, face {face}: {what}");
                    let expected = if covered > 0.0 { expected } else { glam::DVec3::ZERO };
                    for k in 0..3 {
                        let error = (f64::from(got[k]) - expected[k]).abs();
                        assert!(
                            error <= 4e-6 * expected[k],
                            "{what} light is {got:?}, expected {expected} within 4e-6 of it"
                        );
                    }
                    assert!(
                        (f64::from(got[3]) - covered).abs() < 1e-6,
                        "{what} coverage is {}, expected {covered} within 1e-6",
                        got[3]
                    );
                }
            }
        }
        assert!(
            n_neighbours > 500 && (n_faces == 1 || n_behind > 500),
            "{n_faces} faces: {n_neighbours} neighbours are shared with and {n_behind} stand behind walls, expected above 500 of each (of one face none behind walls)"
        );
    }
}

#[test]
fn faces_share_with_those_beside_them() {
    publishes(6);
}

#[test]
fn voxels_share_with_those_around_them() {
    publishes(1);
}

/// In a structure of other cells, and shifted by some: whoever was known keeps every bit but that of rejections,
/// the others are empty.
#[test]
fn carried_records_stay_with_their_cells() {
    for (seed, n_faces, shift) in
        [(1, 6, IVec3::ZERO), (2, 6, IVec3::new(2, -1, 3)), (3, 1, IVec3::new(-8, 0, 0))]
    {
        let mut random = Random(seed);
        let rig = Rig::new(&mut random, n_faces, random_record, |_| 0);
        let before = some_cells(&mut random);
        let (grid, words) = sparse_grid(Vec3::ZERO, 1.0, SIZE, n_faces, &before);
        // No more voxels than the buffers have room for.
        let n_known = (before.len()).min(rig.cells.len());
        let before = cells_of(&words[grid.bricks.element_product() as usize..]);
        let mut all = vec![[0u32; 2]; rig.first_word];
        all.extend(&words);
        let queue = &gpu().queue;
        let room = rig.buffers.structure_before.size() as usize / 8;
        all.truncate(room);
        queue.write_buffer(&rig.buffers.structure_before, 0, bytemuck::cast_slice(&all));
        queue.write_buffer(&rig.buffers.lights_before, 0, bytemuck::cast_slice(&rig.lights));
        let carry = CarryPass::new(gpu());
        let info = CarryInfo { shift, level: LEVEL };
        rig.run(|pass| carry.record(pass, &rig.buffers, &info, rig.slots()));
        let after: Vec<FaceLight> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.lights));
        let mut n_kept = 0;
        for (slot, cell) in rig.cells.iter().enumerate() {
            let old = before.iter().position(|old| old.as_ivec3() == cell.as_ivec3() + shift);
            for face in 0..n_faces as usize {
                let at = rig.first_record + slot * n_faces as usize + face;
                let expected = match old {
                    // What the buffer has no room for reads as nothing.
                    Some(old) if old < n_known => {
                        n_kept += 1;
                        let light = *rig.record_of(old, face);
                        FaceLight { state: light.state & 0x3fff_ffff, ..light }
                    }
                    Some(_) => continue,
                    None => FaceLight::zeroed(),
                };
                let (found, wanted) =
                    (bytemuck::bytes_of(&after[at]), bytemuck::bytes_of(&expected));
                assert!(
                    found == wanted,
                    "shift {shift}, cell {cell}, face {face}: the record is {:?}, expected {expected:?}",
                    after[at]
                );
            }
        }
        assert!(n_kept > 0, "shift {shift}: {n_kept} records are kept, expected some");
        let [found, expected] = [&after, &rig.lights]
            .map(|lights| bytemuck::cast_slice::<_, u8>(&lights[..rig.first_record]));
        assert!(
            found == expected,
            "shift {shift}, records of the first level: {}",
            differing_bytes(found, expected)
        );
    }
}

/// Faces that are covered for the most part by what stands like a wall are noted; cells stay; and each face
/// that had to leave samples out is counted, of every kind of grid.
#[test]
fn walls_and_rejected_samples_are_noted() {
    for n_faces in [6, 1] {
        let mut random = Random(17);
        let record = |random: &mut Random| FaceLight {
            // Floors half-way up close half of a cell an axis: at most 1/8 of a wall is asked for.
            direct: Vec3::ONE,
            n_hits: [0.0, 5.0, 80.0][random.bits() as usize % 3],
            n_rays: 100.0,
            // Depth 0.5, all hits on walls or none; some were rejected.
            state: 0x80
                | [0x0000, 0xff00][random.bits() as usize % 2]
                | (random.bits() as u32 & 1) << 31,
            ..FaceLight::zeroed()
        };
        let rig = Rig::new(&mut random, n_faces, record, |_| 0x3ffff);
        let walls = WallsPass::new(gpu());
        let info = settings!(WallsInfo { level: LEVEL, ..Zeroable::zeroed() });
        rig.run(|pass| walls.record(pass, &rig.buffers, &info, rig.slots()));
        let words = rig.words();
        let moved = cells_of(&words).iter().zip(&rig.cells).filter(|(a, b)| a != b).count();
        assert_eq!(moved, 0, "{n_faces} faces: cells of slots that changed as walls were noted");
        for (slot, word) in words.iter().enumerate() {
            let expected = (0..n_faces as usize).map(|face| {
                let light = rig.record_of(slot, face);
                u32::from(light.n_hits == 80.0 && light.state & 0xff00 != 0) << face
            });
            let expected = if n_faces == 6 { expected.sum() } else { 63 };
            assert_eq!(
                word[1] & 63,
                expected,
                "{n_faces} faces: walls of slot {slot}, a bit a face"
            );
        }
        let own = rig.first_record..rig.lights.len() - N_GUARDS;
        let rejected = rig.lights[own].iter().filter(|l| l.state >> 31 == 1).count();
        let counted: u32 = bytemuck::pod_read_unaligned(&read(&rig.buffers.faults)[..4]);
        assert_eq!(
            counted as usize, rejected,
            "{n_faces} faces: faces that are counted as having rejected samples"
        );
    }
}

/// A binding holds 128 MiB, or what the device allows: so many records of 48 bytes go in and not one more, and the error says which
/// buffer it is and what to do.
#[test]
fn more_records_than_a_binding_holds_are_refused() {
    let layout = settings!(VoxelLevels { n_levels: 1, ..Zeroable::zeroed() });
    let limits = gpu().device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    let most = (limit / size_of::<FaceLight>() as u64) as u32;
    CacheBuffers::new(gpu(), &layout, 64, most).unwrap();
    let error = CacheBuffers::new(gpu(), &layout, 64, most + 1).unwrap_err().to_string();
    for part in ["light of voxels", &limit.to_string(), "lower resolution"] {
        assert!(
            error.contains(part),
            "{} records: the error is `{error}`, expected to contain `{part}`",
            most + 1
        );
    }
}
