// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels `voxel_light/sides` and `voxel_light/reach` over rooms with walls at any angle, against segments and triangles in
//! f64.

use crate::harness::{gpu, read, submit};
use glam::{DVec3, IVec3, UVec3, Vec3};
use lucerna::components::LightVisibility;
use lucerna::components::voxel_light::{Eye, FaceLight, VoxelLight, VoxelLightSettings};
use lucerna::components::voxels::{Resolution, VoxelCounts, VoxelGrid, n_bricks};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::Scene;
use lucerna::settings;
use lucerna::testing::{House, room_with_table};
use std::collections::HashMap;

/// What the kernels found.
struct Found {
    grid: VoxelGrid,
    counts: VoxelCounts,
    cells: Vec<UVec3>,
    sides: Vec<[u32; 4]>,
    /// After some frames.
    lights: Vec<FaceLight>,
}

impl Found {
    fn of(scene: &Scene, cells: u32) -> Self {
        let scene = GpuScene::new(gpu(), scene, GpuSceneOptions::default()).unwrap();
        let settings = settings!(VoxelLightSettings {
            resolution: Resolution::Longest(cells),
            ..Default::default()
        });
        let visibility = LightVisibility::default();
        let mut light = VoxelLight::new(gpu(), &scene, settings, &visibility, Vec3::ONE).unwrap();
        for _ in 0..12 {
            submit(|recorder| light.update(recorder, &scene, &Eye::at(Vec3::ONE)).unwrap());
        }
        let lights = bytemuck::pod_collect_to_vec(&read(&light.buffers().lights));
        let grid = *light.grid(0);
        let counts: VoxelCounts = bytemuck::pod_read_unaligned(&read(&light.buffers().counts[0]));
        let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(&light.buffers().structure));
        let first_slot = n_bricks(&grid) as usize;
        let of = |packed: u32| UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20);
        let slots = words[first_slot..][..counts.n_voxels as usize].iter();
        let sides = words[first_slot + grid.capacity as usize..][..2 * counts.n_records as usize]
            .chunks(2)
            .map(|pair| [pair[0][0], pair[0][1], pair[1][0], pair[1][1]])
            .collect();
        let cells = slots.map(|&[packed, _]| of(packed)).collect();
        Self { grid, counts, cells, sides, lights }
    }

    fn n_first(&self) -> usize {
        6 * self.counts.n_voxels as usize
    }

    /// The first record of a record's face.
    fn first_of(&self, record: usize) -> usize {
        if record < self.n_first() { record } else { self.sides[record][3] as usize }
    }

    fn other_of(&self, record: usize) -> Option<usize> {
        (record < self.n_first() && self.sides[record][3] > 0)
            .then(|| self.sides[record][3] as usize - 1)
    }

    /// From the cell's corner.
    fn place(&self, record: usize) -> Option<DVec3> {
        let word = self.sides[record][1];
        let steps = UVec3::new(word & 1023, word >> 10 & 1023, word >> 20).as_dvec3() - 1.0;
        (word != 0).then(|| steps * 1.25 / 1022.0 - 0.125)
    }

    fn cell(&self, record: usize) -> UVec3 {
        self.cells[self.first_of(record) / 6]
    }

    fn world_place(&self, record: usize) -> Option<DVec3> {
        let place = self.place(record)? + self.cell(record).as_dvec3();
        Some(self.grid.origin.as_dvec3() + f64::from(self.grid.cell) * place)
    }

    /// How far a point is before the border of a record \[cells\]; a border is an octahedron's normal in 511 steps and an offset from
    /// the cell's middle.
    fn before_border(&self, record: usize, point: DVec3) -> f64 {
        let word = self.sides[record][2];
        let [x, y] = [word & 511, word >> 9 & 511].map(|n| f64::from(n) / 511.0 * 2.0 - 1.0);
        let z = 1.0 - x.abs() - y.abs();
        let fold = |a: f64, b: f64| if z < 0.0 { (1.0 - b.abs()) * a.signum() } else { a };
        let normal = DVec3::new(fold(x, y), fold(y, x), z).normalize();
        let offset = (f64::from((word >> 18) - 1) / 16382.0 * 2.0 - 1.0) * 1.25;
        normal.dot(point - 0.5) - offset
    }
}

/// How close the segment from a to b comes to the edges of a triangle that it meets, as a share of the triangle's size, and to
/// the segment's ends; None if it is farther than `margin` from meeting it.
fn meets(a: DVec3, b: DVec3, [p, q, r]: [DVec3; 3], margin: f64) -> bool {
    let normal = (q - p).cross(r - p);
    let (from, to) = (normal.dot(a - p), normal.dot(b - p));
    let slack = margin * normal.length();
    if (from > slack && to > slack) || (from < -slack && to < -slack) || from == to {
        return false;
    }
    let at = a + (b - a) * (from / (from - to)).clamp(0.0, 1.0);
    [(p, q), (q, r), (r, p)].into_iter().all(|(s, e)| {
        let inwards = normal.cross(e - s).normalize();
        inwards.dot(at - s) > -margin
    })
}

/// Reach is what segments between places meet; places stand a tenth of a cell before their surface or lower; two records of a face do
/// not see each other, and each is before its own border and behind the other's. Segments that pass an edge or end at a
/// surface by less than 1e-3 cells are not judged: the places are rounded to 6e-4.
fn check(name: &str, scene: &Scene, cells: u32) -> Found {
    let found = Found::of(scene, cells);
    let triangles: Vec<[DVec3; 3]> = scene
        .instances
        .iter()
        .flat_map(|instance| {
            let mesh = &scene.meshes[instance.mesh];
            mesh.triangles.iter().map(move |triangle| {
                triangle.map(|corner| {
                    let at = mesh.positions[corner as usize];
                    instance.world_from_object.transform_point3(at).as_dvec3()
                })
            })
        })
        .collect();
    let cell = f64::from(found.grid.cell);
    let hidden = |a: DVec3, b: DVec3| {
        let by = |margin: f64| triangles.iter().any(|&t| meets(a, b, t, margin * cell));
        match (by(-1e-3), by(1e-3)) {
            (true, true) => Some(true),
            (false, false) => Some(false),
            _ => None,
        }
    };
    let slots: HashMap<IVec3, usize> =
        found.cells.iter().enumerate().map(|(slot, cell)| (cell.as_ivec3(), slot)).collect();
    let (mut n_judged, mut n_hidden, mut n_divided) = (0, 0, 0);
    for record in 0..found.sides.len() {
        let Some(place) = found.world_place(record) else {
            assert_eq!(found.sides[record][0], 0, "{name}, record {record}: reach without a place");
            continue;
        };
        let own_cell = found.cell(record).as_ivec3();
        let face = found.first_of(record) % 6;
        if let Some(other) = found.other_of(record) {
            n_divided += 1;
            assert_eq!(found.first_of(other), record, "{name}: the face of second record {other}");
            let places = [found.place(record).unwrap(), found.place(other).unwrap()];
            let [own, theirs] = [record, other].map(|of| found.world_place(of).unwrap());
            assert!(
                hidden(own, theirs) != Some(false),
                "{name}, cell {own_cell}, face {face}: its records at {own} and {theirs} see each other"
            );
            for (of, own, theirs) in [(record, 0, 1), (other, 1, 0)] {
                let [before, behind] = [own, theirs].map(|k| found.before_border(of, places[k]));
                assert!(
                    before > -0.02 && behind < 0.02,
                    "{name}, cell {own_cell}, face {face}, record {of}: its place is {before} cells before its border, the other's {behind}"
                );
            }
        }
        for bit in 0..27 {
            let offset = IVec3::new(bit % 3 - 1, bit / 3 % 3 - 1, bit / 9 - 1);
            let is_reached = found.sides[record][0] >> bit & 1 == 1;
            let mut there = slots.get(&(own_cell + offset)).map(|slot| 6 * slot + face);
            if let Some(first) = there
                && offset != IVec3::ZERO
                && let Some(other) = found.other_of(first)
            {
                let from = found.place(record).unwrap() - offset.as_dvec3();
                let before = found.before_border(first, from);
                if before.abs() < 1e-3 {
                    continue;
                }
                if before < 0.0 {
                    there = Some(other);
                }
            }
            let expected = match there.and_then(|there| found.world_place(there)) {
                _ if offset == IVec3::ZERO => Some(true),
                None => Some(false),
                Some(theirs) => hidden(place, theirs).map(|is_hidden| !is_hidden),
            };
            let Some(expected) = expected else { continue };
            n_judged += 1;
            n_hidden += i32::from(!expected && there.is_some());
            assert_eq!(
                is_reached, expected,
                "{name}, cell {own_cell}, face {face}, record {record} at {place}: whether it reaches {offset}"
            );
        }
    }
    println!("{name}: {n_judged} neighbours judged, {n_hidden} hidden; {n_divided} faces divided");
    assert!(n_judged > 5000 && n_hidden > 50, "{name}: {n_judged} judged, {n_hidden} hidden");
    found
}

#[test]
fn records_reach_what_their_places_see() {
    let mut n = [0; 3];
    for seed in [0, 1, 2, 3, 6] {
        let house = House::draw(seed, 8.0 / 20.0);
        let name = format!("house {seed}");
        let found = check(&name, &house.scene, 20);
        let of_house = check_floor(&name, &house, &found);
        n = [0, 1, 2].map(|k| n[k] + of_house[k]);
    }
    let [n_two, n_leaning, n_met] = n;
    assert!(
        n_two > 5 && n_leaning > 3,
        "{n_two} cells of floors on both sides of a wall, {n_leaning} faces that look down and find a leaning wall"
    );
    println!("{n_met} of {n_leaning} records of leaning walls have hits");
    // (Many are so small that few of the 24 rays of 12 frames meet them.)
    assert!(
        5 * n_met > 3 * n_leaning,
        "{n_leaning} records of leaning walls, of which {n_met} have hits, expected more than 3 of 5"
    );
    // What is inside a table is enclosed: nobody needs a record of it.
    let found = check("table", &room_with_table(0.93, 0.1, true, 1), 20);
    let n_first = found.n_first();
    assert_eq!(found.sides.len(), n_first, "table: records, expected one for each face");
}

/// The cells of a house's floor, by 36 points of it: a face that sees parts of more than a quarter on both sides of the wall has two
/// records, one that sees a single side has one; and where the wall leans over the floor, faces that look down find it, although the
/// floor is before it.
///
/// Returns the numbers of floors with two records, of faces that find a leaning wall, and of those that gathering has met.
fn check_floor(name: &str, house: &House, found: &Found) -> [usize; 3] {
    let (origin, cell) = (found.grid.origin.as_dvec3(), f64::from(found.grid.cell));
    let normal = house.normal.as_dvec3();
    let (mut n_one, mut n_two, mut n_leaning, mut n_met) = (0, 0, 0, 0);
    for first in 0..found.n_first() {
        let corner = origin + cell * found.cell(first).as_dvec3();
        let is_floor = corner.y < 0.0 && corner.y + cell > 0.0;
        let is_inside =
            corner.x > 0.0 && corner.z > 0.0 && corner.x + cell < 8.0 && corner.z + cell < 4.0;
        if !is_floor || !is_inside {
            continue;
        }
        let records = [Some(first), found.other_of(first)];
        let places = records.into_iter().flatten().filter_map(|of| found.world_place(of));
        if first % 6 == 3 {
            for record in records.into_iter().flatten() {
                if found.world_place(record).is_some_and(|place| place.y > 0.0) {
                    n_leaning += 1;
                    n_met += usize::from(found.lights[record].n_hits > 0.0);
                }
            }
            continue;
        } else if first % 6 != 2 {
            continue;
        }
        let half = 0.5 * f64::from(house.thickness);
        let count = |is_there: &dyn Fn(f64) -> bool| {
            (0..36)
                .map(|k| {
                    corner
                        + cell * DVec3::new(k as f64 % 6.0 + 0.5, 0.0, (k / 6) as f64 + 0.5) / 6.0
                })
                .filter(|point| {
                    is_there(
                        normal.dot(DVec3::new(point.x, 0.0, point.z) - house.through.as_dvec3()),
                    )
                })
                .count()
        };
        let (lit, dark) = (count(&|off| off > half), count(&|off| off < -half));
        let is_divided = found.other_of(first).is_some();
        if lit > 9 && dark > 9 {
            n_two += 1;
            assert!(
                is_divided,
                "{name}: of 36 points of the floor at {corner} {lit} are lit and {dark} dark, and there is one record"
            );
            let heights: Vec<f64> = places.map(|place| place.y / cell).collect();
            assert!(
                heights.iter().all(|height| (0.01..0.102).contains(height)),
                "{name}: heights over the floor at {corner} are {heights:?} cells, expected 0.1, or less below something"
            );
        } else if count(&|off| off.abs() < half + 1.5 * cell) == 0 {
            // (Nearer, the wall itself may be in the cell.)
            n_one += 1;
            assert!(
                !is_divided,
                "{name}: the floor at {corner} is on one side, and there are two records"
            );
        }
    }
    println!(
        "{name}: {n_one} cells of the floor with one record, {n_two} with two, {n_leaning} faces find a leaning wall"
    );
    assert!(n_one > 50, "{name}: {n_one} cells with one record");
    [n_two, n_leaning, n_met]
}
