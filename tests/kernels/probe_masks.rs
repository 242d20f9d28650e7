// SPDX-License-Identifier: MIT OR Apache-2.0
//! Masks of what probes see of a cell: against the walk of Light-probe volumes (2016) as its text describes it, over areas that are clipped in f64.

use crate::harness::{Random, gpu, map, read, submit};
use crate::probe_light::look_up;
use crate::probes::{lambert, room, upload, world};
use glam::{DVec3, IVec3, Vec3};
use lucerna::components::probes::{ProbeSettings, ProbeVisibility, Probes};
use lucerna::components::voxels::BRICK;
use lucerna::scene::{Material, Mesh};
use lucerna::settings;
use std::collections::{HashMap, HashSet};

/// The area of a triangle within a box, by cutting a polygon with six half-spaces.
fn area_within(corners: [DVec3; 3], low: DVec3, high: DVec3) -> f64 {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for (sign, level) in [(1.0, high[axis]), (-1.0, -low[axis])] {
            let depth = |p: &DVec3| level - sign * p[axis];
            let mut cut = Vec::new();
            for ix in 0..polygon.len() {
                let (p, q) = (polygon[ix], polygon[(ix + 1) % polygon.len()]);
                let (at_p, at_q) = (depth(&p), depth(&q));
                if at_p >= 0.0 {
                    cut.push(p);
                }
                if (at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0) {
                    cut.push(p + (q - p) * (at_p / (at_p - at_q)));
                }
            }
            polygon = cut;
        }
    }
    let Some(&first) = polygon.first() else { return 0.0 };
    let fan = polygon[1..].windows(2).map(|two| (two[0] - first).cross(two[1] - first));
    0.5 * fan.sum::<DVec3>().length()
}

/// The subvolumes that paths from `at` to `goal` see: one is visible if it is open; from a visible one, paths go on to those of its
/// six neighbours between which and the goal there are the fewest subvolumes.
fn walk(
    at: IVec3,
    goal: IVec3,
    open: &dyn Fn(IVec3) -> bool,
    known: &mut HashSet<[i32; 3]>,
    seen: &mut HashSet<[i32; 3]>,
) {
    if !known.insert(at.to_array()) || !open(at) {
        return;
    }
    seen.insert(at.to_array());
    if at == goal {
        return;
    }
    let steps = [IVec3::X, IVec3::Y, IVec3::Z, IVec3::NEG_X, IVec3::NEG_Y, IVec3::NEG_Z];
    let inside = |p: &IVec3| p.cmpge(IVec3::ZERO).all() && p.cmplt(IVec3::splat(4)).all();
    let next: Vec<IVec3> = steps.iter().map(|step| at + *step).filter(inside).collect();
    let apart = |p: &IVec3| (*p - goal).abs().element_sum();
    let fewest = next.iter().map(apart).min().unwrap();
    for step in next.iter().filter(|p| apart(p) == fewest) {
        walk(*step, goal, open, known, seen);
    }
}

/// The mask of the probe at a corner, by paths to all subvolumes of the three faces opposite to it.
fn mask_of(corner: u32, open: &dyn Fn(IVec3) -> bool) -> u64 {
    let upper = IVec3::new((corner & 1) as i32, (corner >> 1 & 1) as i32, (corner >> 2) as i32);
    let start = upper * 3;
    let mut seen = HashSet::new();
    for ix in 0..64 {
        let goal = IVec3::new(ix % 4, ix / 4 % 4, ix / 16);
        if (0..3).any(|axis| goal[axis] == 3 - start[axis]) {
            walk(start, goal, open, &mut HashSet::new(), &mut seen);
        }
    }
    seen.iter().fold(0, |mask, [x, y, z]| mask | 1 << (z * 16 + y * 4 + x))
}

/// The look at one cell: for each corner its mask, or none if a subvolume is too near to call: f32 cannot tell whether more than half of its area
/// faces the corner, or whether a triangle is in it.
fn masks_of_cell(triangles: &[([DVec3; 3], bool)], low: DVec3, edge: f64) -> [Option<u64>; 8] {
    let mut areas: HashMap<[i32; 3], (f64, [f64; 8])> = HashMap::new();
    let mut is_unclear = false;
    for ix in 0..64 {
        let at = IVec3::new(ix % 4, ix / 4 % 4, ix / 16);
        let corner = low + at.as_dvec3() * (edge / 4.0);
        for (corners, double_sided) in triangles {
            // A little larger and a little smaller, so that touching shows.
            let within = |by: f64| {
                let margin = DVec3::splat(by * edge);
                area_within(*corners, corner - margin, corner + edge / 4.0 + margin)
            };
            let area = within(0.0);
            is_unclear |= within(1e-5) > 0.0 && within(-1e-5) == 0.0;
            if area == 0.0 {
                continue;
            }
            let sums = areas.entry(at.to_array()).or_default();
            sums.0 += area;
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            for probe in 0..8 {
                let side = |bit: u32| if probe >> bit & 1 == 1 { 1.0 } else { -1.0 };
                if *double_sided || normal.dot(DVec3::new(side(0), side(1), side(2))) > 0.0 {
                    sums.1[probe] += area;
                }
            }
        }
    }
    std::array::from_fn(|probe| {
        let share = |of: &(f64, [f64; 8])| of.1[probe] / of.0;
        let near_half = areas.values().any(|of| (share(of) - 0.5).abs() < 1e-3);
        let open = |at: IVec3| areas.get(&at.to_array()).is_none_or(|of| share(of) > 0.5);
        (!is_unclear && !near_half).then(|| mask_of(probe as u32, &open))
    })
}

/// On random triangle soups, some of them double-sided, every bit of every cell that can be called is the oracle's: no tolerance.
#[test]
fn masks_are_those_of_the_walk() {
    let mut random = Random(81);
    let (mut n_cells, mut n_masks, mut n_full, mut n_unclear) = (0, 0, 0, 0);
    for (n_triangles, size, cells) in [(6, 1.5, 8), (60, 0.7, 9), (300, 0.3, 10), (40, 3.0, 8)] {
        let mut soup = Vec::new();
        for _ in 0..n_triangles {
            let middle = random.direction() * random.unit();
            soup.push([(); 3].map(|()| middle + size * random.direction() * random.unit()));
        }
        // (Every third one is double-sided.)
        let of = |side: usize| {
            let own: Vec<_> =
                (0..soup.len()).filter(|ix| usize::from(ix % 3 == 0) == side).collect();
            let n = own.len() as u32;
            Mesh {
                positions: own.iter().flat_map(|ix| soup[*ix]).collect(),
                triangles: (0..n).map(|ix| [3 * ix, 3 * ix + 1, 3 * ix + 2]).collect(),
                material: side,
                ..Mesh::default()
            }
        };
        let two_sided = Material { double_sided: true, ..lambert(0.5) };
        let scene = upload(&world(vec![of(0), of(1)], vec![lambert(0.5), two_sided]));
        let chosen =
            settings!(ProbeSettings { cells, n_paths: 1, visibility: ProbeVisibility::Masks });
        let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
        submit(|recorder| probes.update(recorder, &scene)).unwrap();
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&read(probes.masks().unwrap()));
        let lattice = probes.lattice().unwrap();
        let size = lattice.size - 1;
        let bricks = (size + BRICK - 1) / BRICK;
        let triangles: Vec<([DVec3; 3], bool)> = soup
            .iter()
            .enumerate()
            .map(|(ix, corners)| (corners.map(|p| p.as_dvec3()), ix % 3 == 0))
            .collect();
        for ix in 0..size.element_product() {
            let cell = glam::UVec3::new(ix % size.x, ix / size.x % size.y, ix / (size.x * size.y));
            let (at, inside) = (cell / BRICK, cell % BRICK);
            let brick = ((at.z * bricks.y + at.y) * bricks.x + at.x) as usize;
            let bit = (inside.z * BRICK.y + inside.y) * BRICK.x + inside.x;
            let (bits, first) = (words[2 * brick], words[2 * brick + 1]);
            if bits >> bit & 1 == 0 {
                continue;
            }
            n_cells += 1;
            let slot = (first + (bits & ((1 << bit) - 1)).count_ones()) as usize;
            let edge = f64::from(lattice.cell);
            let low = lattice.origin.as_dvec3() + cell.as_dvec3() * edge;
            for (probe, expected) in masks_of_cell(&triangles, low, edge).into_iter().enumerate() {
                let at = 2 * bricks.element_product() as usize + 16 * slot + 2 * probe;
                let found = u64::from(words[at]) | u64::from(words[at + 1]) << 32;
                let Some(expected) = expected else {
                    n_unclear += 1;
                    continue;
                };
                n_masks += 1;
                n_full += usize::from(expected == u64::MAX);
                assert!(
                    found == expected,
                    "cell {cell}, corner {probe}: {found:016x}, expected {expected:016x}"
                );
            }
        }
    }
    assert!(n_cells > 300 && n_unclear * 4 < n_masks, "{n_cells} cells, {n_unclear} not clear");
    assert!(n_full * 2 < n_masks, "{n_full} of {n_masks} masks see everything");
}

/// Every open set of subvolumes: 2000 random ones, dense and sparse, for all corners.
#[test]
fn paths_end_where_the_walk_does() {
    let mut random = Random(82);
    let mut inputs: Vec<[u32; 4]> = vec![[0; 4], [u32::MAX; 4]];
    for ix in 0..2000u32 {
        let mut word = || match ix % 4 {
            0 => random.bits() as u32,
            1 => (random.bits() | random.bits()) as u32,
            2 => (random.bits() | random.bits() | random.bits()) as u32,
            _ => (random.bits() & random.bits()) as u32,
        };
        inputs.push([word(), word(), ix % 8, 0]);
    }
    let found: Vec<[u32; 4]> = map(
        "#import lucerna::components::probes::masks::seen_mask
         alias Input = vec4<u32>;
         alias Output = vec4<u32>;
         fn map(x: Input) -> Output { return vec4<u32>(seen_mask(x.xy, x.z & 7u), 0u, 0u); }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(&found) {
        let bits = u64::from(input[0]) | u64::from(input[1]) << 32;
        let open = |at: IVec3| bits >> (at.z * 16 + at.y * 4 + at.x) & 1 == 1;
        let expected = mask_of(input[2] & 7, &open);
        let found = u64::from(found[0]) | u64::from(found[1]) << 32;
        assert_eq!(found, expected, "open {bits:016x}, corner {}", input[2] & 7);
    }
}

/// The memory of Light-probe volumes (2016), table 4.2, is what its equations say: 4 (n + 1)³ bytes of indices, 27 floats a probe, 4 n³ bytes of
/// indices, 64 a volume (to the table's rounding; of Cornell's second index it has 20 kB where the equation has 16). For as many volumes and probes, our
/// structures take less: two words for 32 cells or corners instead of a word for each, although a probe has its place (8 bytes), which
/// the source has not; and much less with light as halfs.
#[test]
fn masks_take_less_memory_than_the_source() {
    let bricks = |n: u64| n.div_ceil(4) * n.div_ceil(4) * n.div_ceil(2);
    for (name, n, volumes, light, total, misprint) in [
        ("simple", 8u64, 256u64, 61, 82, 0),
        ("Cornell", 16, 563, 121, 197, 4),
        ("subway", 32, 1210, 225, 577, 0),
    ] {
        let probes = light * 1000 / 108;
        let source = 4 * (n + 1).pow(3) + 108 * probes + 4 * n.pow(3) + 64 * volumes;
        assert!(
            (source + misprint * 1000).abs_diff(total * 1000) < 2000,
            "{name}: {source} bytes by the equations, {total} kB in the table"
        );
        let ours =
            |light: u64| 8 * bricks(n + 1) + (light + 8) * probes + 8 * bricks(n) + 64 * volumes;
        let (same, halfs) = (ours(108), ours(56));
        println!(
            "{name}: {probes} probes; source {source} bytes, ours {same} as f32, {halfs} as halfs"
        );
        assert!(same < source + 8 * probes && halfs < source * 2 / 3, "{name}: {same}, {halfs}");
    }
    // The structures are really that large.
    let sheet = Mesh {
        positions: [[0.0, 0.0, 0.0], [1.0, 0.3, 0.0], [0.2, 1.0, 1.0]].map(Vec3::from_array).into(),
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let scene = upload(&world(vec![sheet], vec![lambert(0.5)]));
    let chosen = settings!(ProbeSettings { cells: 16, visibility: ProbeVisibility::Masks });
    let probes = Probes::new(gpu(), &scene, chosen).unwrap();
    let lattice = probes.lattice().unwrap();
    let n_bricks = |size: glam::UVec3| u64::from(((size + BRICK - 1) / BRICK).element_product());
    let structure = probes.occupancy().unwrap().structure().size();
    assert_eq!(structure, 8 * (n_bricks(lattice.size) + u64::from(lattice.capacity)));
    let masks = probes.masks().unwrap().size() - 8 * n_bricks(lattice.size - 1);
    assert_eq!(masks % 64, 0, "bytes of a volume's masks");
}

/// The source's fault (its figures 4.2 and 5.2): where light falls off over a sphere, masks leave squares. Along circles on a sphere, in steps of 1/2000 of
/// its circumference, irradiance jumps at the borders of subvolumes; with distances it does not, nor without visibility: there its
/// steps are those of a function that changes by less than twice its mean over a cell.
#[test]
fn masks_leave_squares_on_a_sphere() {
    let (radius, n_rings, n_sides) = (0.5f32, 24u32, 48u32);
    let mut ball = Mesh::default();
    for ring in 0..=n_rings {
        let (polar, turn) =
            (std::f32::consts::PI / n_rings as f32, std::f32::consts::TAU / n_sides as f32);
        for side in 0..n_sides {
            let (height, around) = ((ring as f32 * polar).cos(), (side as f32 * turn).sin_cos());
            let flat = (ring as f32 * polar).sin();
            ball.positions.push(radius * Vec3::new(flat * around.1, height, flat * around.0));
        }
    }
    let corner = |ring: u32, side: u32| ring * n_sides + side % n_sides;
    for ring in 0..n_rings {
        for side in 0..n_sides {
            let [a, b, c, d] =
                [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| corner(ring + r, side + s));
            ball.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    let mut scene = world(
        vec![room(Vec3::splat(-1.5), Vec3::splat(1.5)), ball],
        vec![lambert(0.7), lambert(0.7)],
    );
    scene.lights.push(lucerna::scene::Light::Point {
        position: Vec3::new(1.2, 1.0, 0.3),
        intensity: Vec3::ONE,
        range: None,
    });
    let scene = upload(&scene);
    let steps = |visibility| {
        let chosen = settings!(ProbeSettings { cells: 14, n_paths: 512, visibility });
        let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
        for _ in 0..8 {
            submit(|recorder| probes.update(recorder, &scene)).unwrap();
        }
        let mut most = 0.0f32;
        for tilt in [0.0f32, 0.4, 0.9] {
            let queries: Vec<(Vec3, Vec3)> = (0..2000u16)
                .map(|ix| {
                    let (sin, cos) = (f32::from(ix) / 2000.0 * std::f32::consts::TAU).sin_cos();
                    let normal = Vec3::new(cos * tilt.cos(), tilt.sin(), sin * tilt.cos());
                    (radius * normal, normal)
                })
                .collect();
            let found: Vec<f32> = look_up(&probes, &queries).iter().map(|of| of[1]).collect();
            let mean = found.iter().sum::<f32>() / found.len() as f32;
            let step = found.windows(2).map(|two| (two[0] - two[1]).abs() / mean);
            most = step.fold(most, f32::max);
        }
        most
    };
    let [masks, distances, none] =
        [ProbeVisibility::Masks, ProbeVisibility::Distances, ProbeVisibility::None].map(steps);
    println!("steps of {masks} with masks, {distances} with distances, {none} with neither");
    assert!(masks > 0.05, "with masks, light jumps by {masks} of its mean");
    // (2 · 2π · 0.5 m / 2000 / 0.27 m.)
    assert!(
        distances < 0.012 && none < 0.012,
        "steps of {distances} with distances, {none} without"
    );
}
