// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels that go over the records of `voxel-rt`'s cache: carry, deposit, publish.

use crate::harness::{Random, assert_each, differing_bytes, gpu, read, storage, submit};
use bytemuck::Zeroable;
use glam::{IVec3, UVec3, Vec3};
use lucerna::bindings::kernels::voxel_light::deposit::DepositInfo;
use lucerna::components::voxel_light::{
    CacheBuffers, CarryInfo, CarryPass, FaceLight, PublishInfo, PublishPass, VoxelLevel,
    VoxelLevels, sparse_grid,
};
use lucerna::components::voxels::VoxelCounts;
use lucerna::gpu::{ComputeKernel, ComputeRecorder, Dispatch, Shaders};
use lucerna::settings;
use std::collections::HashMap;

/// Two levels, of which the second one is looked at: everything of it stands behind the first one's.
struct Rig {
    buffers: CacheBuffers,
    cells: Vec<UVec3>,
    first_word: usize,
    first_record: usize,
    lights: Vec<FaceLight>,
    /// Those of the second level's records.
    sides: Sides,
}

/// The sides of a level's records; none in a grid with one value per voxel.
struct Sides {
    n_first: usize,
    all: Vec<Side>,
}

/// See `components::voxel_light::sides`.
#[derive(Clone, Copy)]
struct Side {
    reach: u32,
    /// From the cell's corner; no coordinate near ½.
    place: Vec3,
    /// A plane through the middle of the cell: an axis, and +1 or −1.
    border: Option<(usize, f32)>,
    /// The face's other record.
    other: Option<usize>,
}

impl Sides {
    fn new(random: &mut Random, n_faces: u32, n_slots: usize) -> Self {
        let n_first = n_slots * n_faces as usize;
        let side = |random: &mut Random| Side {
            reach: random.bits() as u32 & 0x7ff_ffff,
            place: Vec3::from_array(std::array::from_fn(|_| {
                random.range(0.1, 0.4) + 0.5 * (random.bits() % 2) as f32
            })),
            border: None,
            other: None,
        };
        let mut all: Vec<Side> = (0..n_first).map(|_| side(random)).collect();
        if n_faces == 6 {
            for first in 0..n_first {
                if random.unit() < 0.2 {
                    let sign = [1.0, -1.0][random.bits() as usize % 2];
                    all[first].border = Some((random.bits() as usize % 2, sign));
                    all[first].other = Some(all.len());
                    all.push(Side { other: Some(first), ..side(random) });
                }
            }
        }
        Self { n_first, all }
    }

    /// The face's record for a point, from the corner of the record's cell.
    fn for_point(&self, first: usize, point: Vec3) -> usize {
        let Side { border, other, .. } = self.all[first];
        match (border, other) {
            (Some((axis, sign)), Some(other)) if sign * (point[axis] - 0.5) < 0.0 => other,
            _ => first,
        }
    }

    /// The first record of a record's face.
    fn first_of(&self, record: usize) -> usize {
        if record < self.n_first { record } else { self.all[record].other.unwrap() }
    }

    /// Two word pairs for each record.
    fn words(&self) -> Vec<[u32; 2]> {
        let words = |(ix, side): (usize, &Side)| {
            let steps = side.place.map(|x| ((x + 0.125) / 1.25 * 1022.0).round() + 1.0).as_uvec3();
            let border = side.border.map_or(0, |(axis, sign)| {
                // An octahedron's corners along x and y; the plane's offset is 0.
                let mut normal = [0.0; 2];
                normal[axis] = sign;
                let [x, y] = normal.map(|n: f32| ((n * 0.5 + 0.5) * 511.0).round() as u32);
                x | y << 9 | 8192 << 18
            });
            let is_first = ix < self.n_first;
            let other = side.other.map_or(0, |other| other as u32 + u32::from(is_first));
            [[side.reach, steps.x | steps.y << 10 | steps.z << 20], [border, other]]
        };
        self.all.iter().enumerate().flat_map(words).collect()
    }
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
    fn new(random: &mut Random, n_faces: u32, record: impl Fn(&mut Random) -> FaceLight) -> Self {
        let cells = some_cells(random);
        let (grid, words) = sparse_grid(Vec3::ZERO, 1.0, SIZE, n_faces, &cells);
        let n_bricks = grid.bricks.element_product() as usize;
        let n_slots = words.len() - n_bricks;
        let sides = Sides::new(random, n_faces, n_slots);
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
            first_side: (first_word + words.len()) as u32,
            ..Zeroable::zeroed()
        });
        let n_of_level = sides.all.len();
        let n_records = first_record + n_of_level + N_GUARDS;
        let lights: Vec<_> = (0..n_records).map(|_| record(random)).collect();
        let all_words = [other_words, words, sides.words(), vec![[GUARD; 2]; N_GUARDS]].concat();
        let (n_words, n_all) = (all_words.len() as u32, n_records as u32);
        let buffers = CacheBuffers::new(gpu(), &layout, n_words, n_all).unwrap();
        let end = 16 * (n_records - N_GUARDS) as u64;
        for light in [&buffers.reflected, &buffers.shown] {
            gpu().queue.write_buffer(light, end, bytemuck::cast_slice(&[[GUARD; 4]; N_GUARDS]));
        }
        let counts = settings!(VoxelCounts {
            n_voxels: n_slots as u32,
            n_records: n_of_level as u32,
            voxel_groups: UVec3::new((n_slots as u32).div_ceil(64), 1, 1),
            record_groups: UVec3::new((n_of_level as u32).div_ceil(64), 1, 1),
            ..Zeroable::zeroed()
        });
        let queue = &gpu().queue;
        queue.write_buffer(&buffers.structure, 0, bytemuck::cast_slice(&all_words));
        queue.write_buffer(&buffers.lights, 0, bytemuck::cast_slice(&lights));
        queue.write_buffer(&buffers.counts[1], 0, bytemuck::bytes_of(&counts));
        let cells = cells_of(&all_words[first_word + n_bricks..][..n_slots]);
        Self { buffers, cells, first_word, first_record, lights, sides }
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

    fn records(&self) -> Dispatch<'_> {
        self.buffers.records(LEVEL)
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

/// What a record publishes, in f64 over a map of cells instead of bricks: the mean of its own light and of
/// those beside it that it reaches, weighted by ½ an axis and by what of their face a surface covers; of a face with two records, the one on whose
/// side its own place is; for pictures with less of the neighbours the more hits are its own. The coverage of a face with two
/// records is below 0. Tolerance: sums of 27 f32.
fn publishes(n_faces: u32) {
    let mut random = Random(31);
    let rig = Rig::new(&mut random, n_faces, random_record);
    let publish = PublishPass::new(gpu());
    let slots: HashMap<IVec3, usize> =
        rig.cells.iter().enumerate().map(|(slot, cell)| (cell.as_ivec3(), slot)).collect();
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
        let (mut n_neighbours, mut n_beyond, mut n_second) = (0, 0, 0);
        for (record, side) in rig.sides.all.iter().enumerate() {
            let first = rig.sides.first_of(record);
            let (cell, face) = (rig.cells[first / n_faces as usize], first % n_faces as usize);
            let coverage = |light: &FaceLight| f64::from(light.n_hits) / f64::from(light.n_rays);
            let at = rig.first_record + record;
            let own = &rig.lights[at];
            let covered = coverage(own);
            let hits =
                f64::from(own.n_hits) * (f64::from(light_rays) / f64::from(own.n_rays)).min(1.0);
            let share = 64.0 / hits.max(64.0);
            let mut sums = [
                (own.feedback.as_dvec3() * covered, covered),
                (own.indirect.as_dvec3() * covered, covered),
            ];
            for k in 0..27 {
                let axes = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let offset = IVec3::from_array(axes);
                let Some(&other) = slots.get(&(cell.as_ivec3() + offset)) else { continue };
                if offset == IVec3::ZERO || (n_faces == 6 && axes[face / 2] != 0) {
                    continue;
                }
                let mut there = other * n_faces as usize + face;
                if n_faces == 6 {
                    if side.reach >> k & 1 == 0 {
                        n_beyond += 1;
                        continue;
                    }
                    let first = there;
                    there = rig.sides.for_point(first, side.place - offset.as_vec3());
                    n_second += u32::from(there != first);
                }
                n_neighbours += 1;
                let light = &rig.lights[rig.first_record + there];
                let weight = 0.5f64.powi(offset.abs().element_sum()) * coverage(light);
                sums[0].0 += weight * light.feedback.as_dvec3();
                sums[0].1 += weight;
                sums[1].0 += share * weight * light.indirect.as_dvec3();
                sums[1].1 += share * weight;
            }
            let [again, indirect] = sums.map(|(sum, weight)| sum / weight);
            let again = again * f64::from(feedback);
            let is_divided = record == first && side.other.is_some();
            let sign = if is_divided { -1.0 } else { 1.0 };
            let expected = [
                ("reflected", reflected[at], own.direct.as_dvec3() + again),
                ("shown", shown[at], indirect),
            ];
            for (what, got, expected) in expected {
                let what = format!(
                    "feedback {feedback}, cell {cell}, face {face}, record {record}: {what}"
                );
                let expected = if covered > 0.0 { expected } else { glam::DVec3::ZERO };
                for k in 0..3 {
                    let error = (f64::from(got[k]) - expected[k]).abs();
                    assert!(
                        error <= 4e-6 * expected[k],
                        "{what} light is {got:?}, expected {expected} within 4e-6 of it"
                    );
                }
                assert!(
                    (f64::from(got[3]) - sign * covered).abs() < 1e-6
                        && (got[3] < 0.0) == is_divided,
                    "{what} coverage is {}, expected {} within 1e-6, below 0 if the face has two records",
                    got[3],
                    sign * covered
                );
            }
        }
        assert!(
            n_neighbours > 500 && (n_faces == 1 || n_beyond > 500 && n_second > 100),
            "{n_faces} faces: {n_neighbours} neighbours are shared with, {n_beyond} are not reached, {n_second} are second records; expected above 500, 500, 100 (of one face, no sides)"
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

/// In a structure of other cells, and shifted by some: whoever was known keeps every bit but that of rejections, of the record
/// of its face on whose side its place is; the others are empty.
#[test]
fn carried_records_stay_with_their_cells() {
    for (seed, n_faces, shift) in
        [(1, 6, IVec3::ZERO), (2, 6, IVec3::new(2, -1, 3)), (3, 1, IVec3::new(-8, 0, 0))]
    {
        let mut random = Random(seed);
        let rig = Rig::new(&mut random, n_faces, random_record);
        let mut before = some_cells(&mut random);
        // No more voxels than the buffers have room for.
        before.truncate(rig.cells.len() - 60);
        let (grid, mut words) = sparse_grid(Vec3::ZERO, 1.0, SIZE, n_faces, &before);
        let n_bricks = grid.bricks.element_product() as usize;
        let before = cells_of(&words[n_bricks..]);
        let sides = Sides::new(&mut random, n_faces, before.len());
        // The layout is that of today's capacity.
        words.resize(n_bricks + rig.cells.len(), [0; 2]);
        let all = [vec![[0u32; 2]; rig.first_word], words, sides.words()].concat();
        let queue = &gpu().queue;
        assert!(
            8 * all.len() as u64 <= rig.buffers.structure_before.size(),
            "words of the former structure: {}, expected no more than there is room for",
            all.len()
        );
        queue.write_buffer(&rig.buffers.structure_before, 0, bytemuck::cast_slice(&all));
        queue.write_buffer(&rig.buffers.lights_before, 0, bytemuck::cast_slice(&rig.lights));
        let carry = CarryPass::new(gpu());
        let info = CarryInfo { shift, level: LEVEL };
        rig.run(|pass| carry.record(pass, &rig.buffers, &info, rig.records()));
        let after: Vec<FaceLight> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.lights));
        let (mut n_kept, mut n_second) = (0, 0);
        for (record, side) in rig.sides.all.iter().enumerate() {
            let first = rig.sides.first_of(record);
            let (cell, face) = (rig.cells[first / n_faces as usize], first % n_faces as usize);
            let old = before.iter().position(|old| old.as_ivec3() == cell.as_ivec3() + shift);
            let expected = old.map_or(FaceLight::zeroed(), |slot| {
                let first = slot * n_faces as usize + face;
                let from = sides.for_point(first, side.place);
                n_kept += 1;
                n_second += u32::from(from != first);
                let light = rig.lights[rig.first_record + from];
                FaceLight { state: light.state & 0x3fff_ffff, ..light }
            });
            let found = after[rig.first_record + record];
            assert!(
                bytemuck::bytes_of(&found) == bytemuck::bytes_of(&expected),
                "shift {shift}, cell {cell}, face {face}, record {record}: it is {found:?}, expected {expected:?}"
            );
        }
        assert!(
            n_kept > 5 && (n_faces == 1 || n_second > 3),
            "shift {shift}: {n_kept} records are kept, {n_second} of them second ones, expected above 5 and 3"
        );
        let [found, expected] = [&after, &rig.lights]
            .map(|lights| bytemuck::cast_slice::<_, u8>(&lights[..rig.first_record]));
        assert!(
            found == expected,
            "shift {shift}, records of the first level: {}",
            differing_bytes(found, expected)
        );
    }
}

/// What rays deposit on a face becomes the direct light of both of its records.
#[test]
fn both_records_of_a_face_get_its_deposits() {
    let mut random = Random(23);
    let rig = Rig::new(&mut random, 6, random_record);
    // As many as the level has first records; every third one got nothing.
    let means: Vec<[f32; 4]> = (0..rig.sides.n_first)
        .map(|ix| if ix % 3 == 0 { [0.0; 4] } else { [random.unit(), 1.0, ix as f32, 5.0] })
        .collect();
    let name = "voxel_light/deposit";
    let kernel = ComputeKernel::new(gpu(), &Shaders::default(), None, name);
    let info = settings!(DepositInfo { level: LEVEL, light_frames: 1, ..Zeroable::zeroed() });
    let deposited = storage(bytemuck::cast_slice(&means));
    rig.run(|pass| {
        let call = kernel.call(pass).uniform("info", &info).with(rig.buffers.of_level(LEVEL));
        call.bind("means", &deposited).dispatch(rig.records());
    });
    let after: Vec<FaceLight> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.lights));
    for record in 0..rig.sides.all.len() {
        let [r, g, b, _] = means[rig.sides.first_of(record)];
        let found = after[rig.first_record + record].direct;
        assert_eq!(found, Vec3::new(r, g, b), "record {record}: deposited light");
    }
}

/// Each record that had to leave samples out is counted, second ones as well, of every kind of grid; and those whose driver ended loops early.
#[test]
fn rejected_samples_are_counted() {
    for n_faces in [6, 1] {
        let mut random = Random(17);
        let record = |random: &mut Random| FaceLight {
            state: random.bits() as u32 & 0xff00_00ff,
            ..FaceLight::zeroed()
        };
        let rig = Rig::new(&mut random, n_faces, record);
        let publish = PublishPass::new(gpu());
        let info = settings!(PublishInfo { level: LEVEL, ..Zeroable::zeroed() });
        rig.run(|pass| publish.record(pass, &rig.buffers, &info, rig.records()));
        let own = &rig.lights[rig.first_record..rig.lights.len() - N_GUARDS];
        let expected = [31, 30]
            .map(|bit| own.iter().filter(|light| light.state >> bit & 1 == 1).count() as u32);
        let counted: Vec<u32> = bytemuck::pod_collect_to_vec(&read(&rig.buffers.faults));
        assert_eq!(
            counted[..2],
            expected,
            "{n_faces} faces: records that are counted as having rejected and missing samples"
        );
    }
}

/// Once the light has settled, it is published in one of SETTLED_PERIOD frames, and always by callers that give frame 0.
#[test]
fn settled_light_is_published_in_turn() {
    let mut random = Random(18);
    let rig = Rig::new(&mut random, 6, random_record);
    let publish = PublishPass::new(gpu());
    let at = std::mem::offset_of!(VoxelLevels, is_settled) as u64;
    for (is_settled, frame, is_published) in
        [(0u32, 1, true), (1, 1, false), (1, 6, false), (1, 8, true), (1, 0, true)]
    {
        gpu().queue.write_buffer(&rig.buffers.levels, at, bytemuck::bytes_of(&is_settled));
        submit(|recorder| recorder.encoder().clear_buffer(&rig.buffers.shown, 0, None));
        let info = settings!(PublishInfo { level: LEVEL, frame, ..Zeroable::zeroed() });
        rig.run(|pass| publish.record(pass, &rig.buffers, &info, rig.records()));
        let found = read(&rig.buffers.shown).iter().any(|byte| *byte != 0);
        assert_eq!(found, is_published, "settled {is_settled}, frame {frame}: published");
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
