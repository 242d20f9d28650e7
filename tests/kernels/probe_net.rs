// SPDX-License-Identifier: MIT OR Apache-2.0
//! Delaunay nets: against scipy's, on grids and other cospherical points, and walks against brute force in f64.

use crate::harness::{Largest, Random, gpu, map, read, storage, submit};
use crate::probe_light::look_up;
use crate::probes::{lambert, room, upload, world};
use glam::{DVec3, Vec3};
use lucerna::components::probe_net::{FindPass, NetError, NetKind, OUTSIDE, ProbeNet};
use lucerna::components::probes::{ProbeBasis, ProbeSettings, ProbeVisibility, Probes};
use lucerna::settings;
use std::collections::HashSet;
use std::f64::consts::PI;

/// Six times the volume of a tetrahedron.
fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).dot((c - a).cross(d - a))
}

fn corners(net: &ProbeNet, vertices: [u32; 4]) -> [DVec3; 4] {
    vertices.map(|v| net.points()[v as usize].as_dvec3())
}

/// What must hold of a net in space: cells are positively oriented, neighbours share a face and know of each other, the hull is closed and convex, and the cells
/// fill it.
fn check_space(net: &ProbeNet, what: &str) {
    assert_eq!(net.kind(), NetKind::Space, "{what}");
    let mut filled = 0.0;
    for (ix, cell) in net.cells().iter().enumerate() {
        let at = corners(net, cell.vertices);
        assert!(volume(at).abs() >= 0.0, "{what}: cell {ix}");
        filled += volume(at).abs();
        for (side, neighbour) in cell.neighbours.iter().enumerate() {
            let face: HashSet<u32> =
                (0..4).filter(|k| *k != side).map(|k| cell.vertices[k]).collect();
            if neighbour & OUTSIDE != 0 {
                let hull = net.faces()[(neighbour & !OUTSIDE) as usize];
                assert_eq!(hull.cell as usize, ix, "{what}: the cell of a face of the hull");
                assert_eq!(HashSet::from(hull.vertices), face, "{what}: corners of the hull");
                // Counter-clockwise from outside: the cell's other corner is behind.
                let [a, b, c] = hull.vertices.map(|v| net.points()[v as usize].as_dvec3());
                let apex = net.points()[cell.vertices[side] as usize].as_dvec3();
                let height = (b - a).cross(c - a).dot(apex - a);
                assert!(height <= 1e-12, "{what}: a face of the hull looks inwards, {height}");
            } else {
                let other = net.cells()[*neighbour as usize];
                assert!(face.iter().all(|v| other.vertices.contains(v)), "{what}: a shared face");
                assert!(
                    other.neighbours.contains(&(ix as u32)),
                    "{what}: neighbours of each other"
                );
            }
        }
    }
    // The hull's volume, as seen from a point inside.
    let middle =
        net.points().iter().map(|p| p.as_dvec3()).sum::<DVec3>() / net.points().len() as f64;
    let mut of_hull = 0.0;
    for (ix, face) in net.faces().iter().enumerate() {
        let [a, b, c] = face.vertices.map(|v| net.points()[v as usize].as_dvec3());
        of_hull += volume([middle, a, b, c]);
        for (k, neighbour) in face.neighbours.iter().enumerate() {
            let other = net.faces()[*neighbour as usize];
            let edge = [face.vertices[k], face.vertices[(k + 1) % 3]];
            assert!(
                edge.iter().all(|v| other.vertices.contains(v)),
                "{what}: an edge of face {ix}"
            );
        }
    }
    let off = (filled - of_hull).abs() / of_hull;
    assert!(off < 1e-9, "{what}: cells fill {filled}, the hull has {of_hull}");
}

fn random_points(random: &mut Random, n: usize) -> Vec<Vec3> {
    (0..n).map(|_| Vec3::new(random.unit(), random.unit(), random.unit()) * 4.0 - 1.0).collect()
}

fn grid([nx, ny, nz]: [u32; 3]) -> Vec<Vec3> {
    (0..nx * ny * nz)
        .map(|ix| Vec3::new((ix % nx) as f32, (ix / nx % ny) as f32, (ix / (nx * ny)) as f32) * 0.5)
        .collect()
}

/// Points whose net is hard: cospherical, in rows, in layers, near each other, far from the origin.
fn hard_points() -> Vec<(&'static str, Vec<Vec3>)> {
    let mut random = Random(61);
    let on_sphere = (0..300).map(|_| random.direction()).collect();
    let turned = |of: Vec<Vec3>| {
        let turn = glam::Mat3::from_rotation_y(0.3) * glam::Mat3::from_rotation_x(0.7);
        of.into_iter().map(|p| turn * p).collect::<Vec<_>>()
    };
    let far = grid([4, 5, 3]).into_iter().map(|p| p + 1000.0).collect();
    let mut doubled = grid([3, 3, 3]);
    doubled.extend(grid([3, 3, 3]));
    let mut clustered = random_points(&mut random, 200);
    clustered.extend(random_points(&mut random, 200).into_iter().map(|p| p * 1e-3));
    // As fillers are: in the middle of edges, of the hull as well.
    let with_middles = |points: Vec<Vec3>| {
        let net = ProbeNet::new(&points).unwrap();
        let middle = |[a, b]: [u32; 2]| 0.5 * (net.points()[a as usize] + net.points()[b as usize]);
        let middles: Vec<Vec3> = net.edges().into_iter().map(middle).collect();
        [points, middles].concat()
    };
    let divided = with_middles(with_middles(random_points(&mut random, 12)));
    // (A cluster of 1/100: in halves of needles of 1/1000, f32 is off by more than the limit below.)
    let small = clustered[200..250].iter().map(|p| *p * 10.0);
    let divided_clusters = with_middles(clustered[150..200].iter().copied().chain(small).collect());
    let divided_grid = with_middles(turned(grid([4, 3, 3])));
    let layers = grid([12, 12, 2]).into_iter().map(|p| p * Vec3::new(1.0, 1.0, 0.01)).collect();
    vec![
        ("a cube", grid([2, 2, 2])),
        ("a grid", grid([6, 5, 4])),
        ("a turned grid", turned(grid([6, 5, 4]))),
        ("a long grid", grid([40, 2, 2])),
        ("a grid far from the origin", far),
        ("a grid twice", doubled),
        ("a sphere", on_sphere),
        ("two thin layers", layers),
        ("clusters", clustered),
        ("divided edges", divided),
        ("a divided turned grid", divided_grid),
        ("divided clusters", divided_clusters),
        ("four points", vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z]),
        ("random", random_points(&mut random, 2000)),
    ]
}

#[test]
fn nets_are_whole() {
    for (what, points) in hard_points() {
        let net = ProbeNet::new(&points).unwrap();
        check_space(&net, what);
        let unique: HashSet<_> = points.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert_eq!(net.points().len(), unique.len(), "{what}: points");
        assert_eq!(net.n_duplicates(), points.len() - unique.len(), "{what}: duplicates");
    }
}

/// scipy 1.x (Qhull) gives the same tetrahedra for random points, where there is but one Delaunay triangulation: `fixtures/reference/delaunay.json`, made by
/// `fixtures/reference/delaunay.py`.
#[test]
fn random_nets_are_those_of_scipy() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/reference/delaunay.json");
    let json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    for case in json.as_array().unwrap() {
        let number = |of: &serde_json::Value| of.as_f64().unwrap() as f32;
        let points: Vec<Vec3> = case["points"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| Vec3::new(number(&p[0]), number(&p[1]), number(&p[2])))
            .collect();
        let net = ProbeNet::new(&points).unwrap();
        let sorted = |mut of: Vec<u32>| {
            of.sort_unstable();
            of
        };
        let found: HashSet<Vec<u32>> =
            net.cells().iter().map(|c| sorted(c.vertices.to_vec())).collect();
        let hull: HashSet<Vec<u32>> =
            net.faces().iter().map(|f| sorted(f.vertices.to_vec())).collect();
        let list = |name: &str| -> HashSet<Vec<u32>> {
            let rows = case[name].as_array().unwrap().iter();
            rows.map(|row| {
                sorted(row.as_array().unwrap().iter().map(|v| v.as_u64().unwrap() as u32).collect())
            })
            .collect()
        };
        assert_eq!(found, list("cells"), "cells of {} points", points.len());
        assert_eq!(hull, list("hull"), "hull of {} points", points.len());
    }
}

struct Walks {
    found: Vec<([u32; 4], [f64; 4])>,
    most_steps: u32,
    n_lost: u32,
}

fn walk(net: &ProbeNet, points: &[Vec3]) -> Walks {
    let buffers = net.upload(gpu()).unwrap();
    let input: Vec<[f32; 4]> = points.iter().map(|p| p.extend(0.0).to_array()).collect();
    let [input, found, counts] = [
        storage(bytemuck::cast_slice(&input)),
        storage(&vec![0; 32 * points.len()]),
        storage(&[0; 16]),
    ];
    let pass = FindPass::new(gpu());
    submit(|recorder| {
        pass.record(recorder, &buffers, &input, &found, &counts, points.len() as u32)
    });
    let words: Vec<[u32; 8]> = bytemuck::pod_collect_to_vec(&read(&found));
    let [most_steps, n_lost, ..]: [u32; 4] = bytemuck::pod_read_unaligned(&read(&counts)[..16]);
    let of = |w: &[u32; 8]| {
        ([w[0], w[1], w[2], w[3]], [4, 5, 6, 7].map(|k| f64::from(f32::from_bits(w[k]))))
    };
    Walks { found: words.iter().map(of).collect(), most_steps, n_lost }
}

/// Points inside, on faces, edges and corners, and outside of a net.
fn queries(net: &ProbeNet, random: &mut Random, n: usize) -> Vec<Vec3> {
    let points = net.points();
    let low = points.iter().copied().reduce(Vec3::min).unwrap();
    let high = points.iter().copied().reduce(Vec3::max).unwrap();
    let extent = (high - low).max_element().max(1.0);
    (0..n)
        .map(|ix| {
            let some = |random: &mut Random| points[random.bits() as usize % points.len()];
            match ix % 8 {
                0 => some(random),
                1 => 0.5 * (some(random) + some(random)),
                2 if !net.cells().is_empty() => {
                    let cell = net.cells()[random.bits() as usize % net.cells().len()];
                    let [a, b, c, _] = cell.vertices.map(|v| points[v as usize]);
                    (a + b + c) / 3.0
                }
                3 => 0.5 * (low + high) + 3.0 * extent * random.direction(),
                _ => {
                    low + (high - low)
                        * Vec3::new(random.unit(), random.unit(), random.unit())
                        * 1.2
                        - 0.1 * (high - low)
                }
            }
        })
        .collect()
}

/// The nearest point of a triangle by brute force over its plane and edges, in f64.
fn nearest_of(at: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    if normal.length() > 0.0 {
        let on = at - normal * ((at - a).dot(normal) / normal.length_squared());
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|(p, q)| (*q - *p).cross(on - *p).dot(normal) >= 0.0);
        if inside {
            return on;
        }
    }
    [(a, b), (b, c), (c, a)]
        .map(|(p, q)| {
            let length = (q - p).length_squared().max(1e-300);
            p + (q - p) * ((at - p).dot(q - p) / length).clamp(0.0, 1.0)
        })
        .into_iter()
        .min_by(|x, y| x.distance(at).total_cmp(&y.distance(at)))
        .unwrap()
}

/// 10⁵ walks: inside the hull, the weighted probes are the point itself, and they are the corners of a cell; outside, they are the nearest point
/// of the hull, by brute force over all its faces. Weights are at least 0, their sum is 1. No walk is lost. Tolerance: f32's roundings of
/// positions over the thinness of cells.
#[test]
fn walks_arrive() {
    let mut random = Random(62);
    for (what, points) in hard_points() {
        let net = ProbeNet::new(&points).unwrap();
        let low = net.points().iter().copied().reduce(Vec3::min).unwrap();
        let high = net.points().iter().copied().reduce(Vec3::max).unwrap();
        let size = f64::from((high - low).max_element().max(high.abs().max_element() * 1e-2));
        let asked = queries(&net, &mut random, 10_000);
        let walks = walk(&net, &asked);
        assert_eq!(walks.n_lost, 0, "{what}: walks that were lost");
        assert!(walks.most_steps < 200, "{what}: {} steps", walks.most_steps);
        println!(
            "{what}: {} points, {} cells, at most {} steps",
            points.len(),
            net.cells().len(),
            walks.most_steps
        );
        let known: HashSet<Vec<u32>> = net
            .cells()
            .iter()
            .map(|cell| {
                let mut v = cell.vertices.to_vec();
                v.sort_unstable();
                v
            })
            .collect();
        let mut n_outside = 0;
        for (at, (probes, weights)) in asked.iter().zip(&walks.found) {
            let at = at.as_dvec3();
            let sum: f64 = weights.iter().sum();
            assert!(
                (sum - 1.0).abs() < 1e-5 && weights.iter().all(|w| *w >= 0.0),
                "{what}, {at}: {weights:?}"
            );
            let place: DVec3 =
                (0..4).map(|k| net.points()[probes[k] as usize].as_dvec3() * weights[k]).sum();
            let mut key = probes.to_vec();
            key.sort_unstable();
            let is_cell = known.contains(&key) && probes[3] != 0 || weights[3] > 0.0;
            // (1e-6 of an edge over the thinness of cells, which in the clusters is 1e-3.)
            let limit = if what.ends_with("clusters") { 1e-3 } else { 3e-5 };
            if place.distance(at) < limit * size {
                continue;
            }
            // Outside, or the walk is wrong.
            n_outside += 1;
            assert!(
                !is_cell || weights[3] == 0.0,
                "{what}, {at}: {place} of a cell {probes:?} {weights:?}"
            );
            let nearest = net
                .faces()
                .iter()
                .map(|face| {
                    nearest_of(at, face.vertices.map(|v| net.points()[v as usize].as_dvec3()))
                })
                .min_by(|x, y| x.distance(at).total_cmp(&y.distance(at)))
                .unwrap();
            let off = place.distance(at) - nearest.distance(at);
            assert!(
                off.abs() < 1e-4 * size,
                "{what}, {at}: the walk finds {place}, the nearest point of the hull is {nearest}"
            );
        }
        assert!(n_outside > 1000, "{what}: points outside: {n_outside}");
    }
}

/// A linear function of the points comes back inside the hull; and light is continuous everywhere, also over the hull: it changes by no more than the
/// place that is found does.
#[test]
fn nets_interpolate() {
    let mut random = Random(63);
    for (what, points) in hard_points() {
        let net = ProbeNet::new(&points).unwrap();
        let value = |p: DVec3| 2.0 + DVec3::new(0.3, -0.2, 0.5).dot(p);
        let asked = queries(&net, &mut random, 2000);
        let near: Vec<Vec3> = asked.iter().map(|p| *p + 1e-3 * random.direction()).collect();
        let [here, beside] = [walk(&net, &asked), walk(&net, &near)];
        let of = |(probes, weights): &([u32; 4], [f64; 4])| -> (f64, DVec3) {
            let point = |k: usize| net.points()[probes[k] as usize].as_dvec3();
            (
                (0..4).map(|k| value(point(k)) * weights[k]).sum(),
                (0..4).map(|k| point(k) * weights[k]).sum(),
            )
        };
        for ((at, here), beside) in asked.iter().zip(&here.found).zip(&beside.found) {
            let ((here, place), (beside, other)) = (of(here), of(beside));
            assert!(
                (here - value(place)).abs() < 1e-4 * here.abs().max(1.0),
                "{what}, {at}: {here}"
            );
            // A projection onto a convex set brings no two points apart.
            let scale = f64::from(at.abs().max_element()).max(1.0);
            assert!(
                place.distance(other) < 1e-3 + 2e-4 * scale,
                "{what}, {at}: {place}, then {other}"
            );
            assert!(
                (here - beside).abs() < 1e-3 + 2e-4 * scale,
                "{what}, {at}: {here}, then {beside}"
            );
        }
    }
}

/// 0 to 4 points, points on a line and in a plane at any angle, the same point many times: each gives what its kind says, and the nearest place of its points' hull.
#[test]
fn few_and_flat_points() {
    let mut random = Random(64);
    let direction = Vec3::new(0.3, 0.5, -0.8).normalize();
    let across = direction.any_orthonormal_vector();
    let in_plane = |random: &mut Random| {
        direction * random.unit() * 3.0 + across * random.unit() * 2.0 + Vec3::splat(0.7)
    };
    let cases: Vec<(NetKind, Vec<Vec3>)> = vec![
        (NetKind::Empty, vec![]),
        (NetKind::Point, vec![Vec3::ONE]),
        (NetKind::Point, vec![Vec3::ONE; 5]),
        (NetKind::Line, vec![Vec3::ONE, Vec3::NEG_ONE]),
        (
            NetKind::Line,
            [3.0, -1.0, 0.5, 2.0, 0.5].map(|t| Vec3::splat(0.3) + direction * t).into(),
        ),
        (NetKind::Plane, vec![Vec3::X, Vec3::Y, Vec3::Z]),
        (NetKind::Plane, vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::splat(1.0 / 3.0)]),
        (NetKind::Plane, (0..200).map(|_| in_plane(&mut random)).collect()),
        (NetKind::Plane, grid([9, 7, 1])),
        (NetKind::Plane, grid([1, 9, 7])),
        (NetKind::Space, vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE]),
    ];
    for (kind, points) in cases {
        let net = ProbeNet::new(&points).unwrap();
        assert_eq!(net.kind(), kind, "{points:?}");
        let asked: Vec<Vec3> =
            (0..3000).map(|_| 4.0 * random.direction() * random.unit()).collect();
        let walks = walk(&net, &asked);
        assert_eq!(walks.n_lost, 0, "{kind:?}: walks that were lost");
        for (at, (probes, weights)) in asked.iter().zip(&walks.found) {
            let at = at.as_dvec3();
            let sum: f64 = weights.iter().sum();
            if kind == NetKind::Empty {
                assert_eq!(sum, 0.0, "weights without probes");
                continue;
            }
            assert!((sum - 1.0).abs() < 1e-5, "{kind:?}: weights {weights:?}");
            let place: DVec3 =
                (0..4).map(|k| net.points()[probes[k] as usize].as_dvec3() * weights[k]).sum();
            let p = |ix: usize| net.points()[ix].as_dvec3();
            let candidates: Vec<DVec3> = match kind {
                NetKind::Point => vec![p(0)],
                NetKind::Line => (1..net.points().len())
                    .map(|ix| nearest_of(at, [p(ix - 1), p(ix), p(ix)]))
                    .collect(),
                _ => net
                    .faces()
                    .iter()
                    .map(|f| nearest_of(at, f.vertices.map(|v| p(v as usize))))
                    .collect(),
            };
            let nearest = candidates.iter().map(|c| c.distance(at)).fold(f64::MAX, f64::min);
            let is_inside = kind == NetKind::Space && place.distance(at) < 1e-5;
            assert!(
                is_inside || (place.distance(at) - nearest).abs() < 1e-4,
                "{kind:?}, {at}: finds {place}, {} away; the nearest is {nearest} away",
                place.distance(at)
            );
        }
    }
    let wrong = ProbeNet::new(&[Vec3::ZERO, Vec3::NAN]).unwrap_err();
    assert!(matches!(wrong, NetError::NotFinite(1)), "{wrong}");
    // The same points give the same net.
    let points = random_points(&mut random, 500);
    let [a, b] = [ProbeNet::new(&points).unwrap(), ProbeNet::new(&points).unwrap()];
    assert_eq!((a.cells(), a.faces()), (b.cells(), b.faces()), "two nets of the same points");
}

/// The nearest points of triangles and segments, and weights in tetrahedra, in f64. A point that is as near on two features may be on either.
#[test]
fn nearest_points_are_the_nearest() {
    let mut random = Random(65);
    let mut point = || Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - 1.0;
    let inputs: Vec<[[f32; 4]; 5]> = (0..4000)
        .map(|ix| {
            let [a, b, c, d] = [point(), point(), point(), point()];
            let at = match ix % 5 {
                0 => a,
                1 => 0.5 * (a + b),
                2 => (a + b + c) / 3.0,
                _ => 2.0 * point(),
            };
            [at, a, b, c, d].map(|p| p.extend(0.0).to_array())
        })
        .collect();
    let found: Vec<[[f32; 4]; 3]> = map(
        "#import lucerna::geometry::nearest_point::{in_tetrahedron, nearest_on_segment, nearest_on_triangle}
         struct Input { p: vec4<f32>, a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, d: vec4<f32> }
         struct Output { triangle: vec4<f32>, tetrahedron: vec4<f32>, segment: vec4<f32> }
         fn map(x: Input) -> Output {
             // (As the function wants them.)
             let a = x.a.xyz;
             let turned = dot(x.b.xyz - a, cross(x.c.xyz - a, x.d.xyz - a)) < 0.0;
             let inside = in_tetrahedron(
                 x.p.xyz, a, x.b.xyz, select(x.c.xyz, x.d.xyz, turned), select(x.d.xyz, x.c.xyz, turned),
             );
             let volumes = inside.heights * inside.areas;
             let weights = volumes / dot(volumes, vec4<f32>(1.0));
             return Output(
                 vec4<f32>(nearest_on_triangle(x.p.xyz, x.a.xyz, x.b.xyz, x.c.xyz), 0.0),
                 select(weights, weights.xywz, turned),
                 vec4<f32>(nearest_on_segment(x.p.xyz, x.a.xyz, x.b.xyz)),
             );
         }",
        &inputs,
    );
    for (input, [triangle, tetrahedron, segment]) in inputs.iter().zip(found) {
        let [p, a, b, c, d] = input.map(|v| Vec3::from_slice(&v).as_dvec3());
        let weighted = |w: [f32; 4], of: &[DVec3]| -> DVec3 {
            of.iter().zip(w).map(|(p, w)| *p * f64::from(w)).sum()
        };
        let off = weighted(triangle, &[a, b, c]).distance(p) - nearest_of(p, [a, b, c]).distance(p);
        assert!(off.abs() < 1e-4, "triangle {a} {b} {c} and {p}: {triangle:?}, off by {off}");
        let share = f64::from(segment[0]);
        let off = (a + (b - a) * share).distance(p) - nearest_of(p, [a, b, b]).distance(p);
        assert!(off.abs() < 1e-5, "segment {a} {b} and {p}: {share}");
        if volume([a, b, c, d]).abs() > 1e-2 {
            let off = (weighted(tetrahedron, &[a, b, c, d]) - p).largest();
            let sum: f32 = tetrahedron.iter().sum();
            assert!(off < 1e-3 && (sum - 1.0).abs() < 1e-4, "tetrahedron and {p}: {tetrahedron:?}");
        }
    }
}

/// A linear function of the points comes back between a net's probes as it is, and a constant everywhere, whatever sees or wraps.
/// Tolerance: walks' own (1e-4 of the largest value).
#[test]
fn a_net_reproduces_linear_light() {
    let mut random = Random(64);
    let walls = room(Vec3::splat(-2.0), Vec3::splat(4.0));
    let scene = upload(&world(vec![walls], vec![lambert(0.5)]));
    let points = random_points(&mut random, 300);
    let net = ProbeNet::new(&points).unwrap();
    let plain = settings!(ProbeSettings {
        n_paths: 1,
        visibility: ProbeVisibility::None,
        wraps: false,
        roots: false,
        basis: ProbeBasis::Sh2Float,
    });
    let value = |p: DVec3| 9.0 + DVec3::new(0.7, -0.4, 0.2).dot(p);
    let inside: Vec<Vec3> = (0..2000)
        .map(|_| {
            let cell = net.cells()[random.bits() as usize % net.cells().len()];
            let shares = [0; 4].map(|_| random.unit() + 1e-3);
            let sum: f32 = shares.iter().sum();
            (0..4).map(|k| net.points()[cell.vertices[k] as usize] * (shares[k] / sum)).sum()
        })
        .collect();
    let queries: Vec<(Vec3, Vec3)> = inside.iter().map(|p| (*p, random.direction())).collect();
    let full =
        settings!(ProbeSettings { visibility: ProbeVisibility::Distances, wraps: true, ..plain });
    for (settings, slope) in [(plain, 1.0), (full, 0.0)] {
        let mut probes = Probes::on_net(gpu(), &scene, settings, net.clone()).unwrap();
        submit(|recorder| probes.update(recorder, &scene)).unwrap();
        let of = |p: DVec3| 9.0 + slope * (value(p) - 9.0);
        let words: Vec<[f32; 27]> = net
            .points()
            .iter()
            .map(|p| {
                let mut words = [0.0; 27];
                words[..3].fill(of(p.as_dvec3()) as f32);
                words
            })
            .collect();
        gpu().queue.write_buffer(probes.light(), 0, bytemuck::cast_slice(&words));
        for ((at, _), found) in queries.iter().zip(look_up(&probes, &queries)) {
            // A constant c of radiance is an irradiance of πY₀₀c.
            let expected = PI * (1.0 / (4.0 * PI)).sqrt() * of(at.as_dvec3());
            let off = (f64::from(found[1]) - expected).abs();
            assert!(off < 1e-4 * 12.0, "at {at}: {found:?}, expected {expected}");
        }
    }
}

/// What is a sliver, by closed forms: of a regular tetrahedron the circumscribed radius is √(3/8) of an edge, of a flat square half its diagonal, of a needle
/// of height h over a triangle of edge 1 about h/2. The middle of the longest edge is where a probe is missing.
#[test]
fn slivers_are_found() {
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.0, 0.75f32.sqrt()]].map(Vec3::from);
    let over = |height: f32| Vec3::new(0.5, height, 0.75f32.sqrt() / 3.0);
    let of = |points: &[Vec3]| ProbeNet::new(points).unwrap().slivers();
    let with = |height: f32| of(&[triangle.as_slice(), &[over(height)]].concat());
    assert_eq!(with((2.0f32 / 3.0).sqrt()), [], "regular");
    // R = (h² + 1/3)/(2h): 1.96 and 2.1 of an edge.
    assert_eq!(with(3.8), [], "a needle of 3.8 edges");
    let found = with(4.2);
    assert_eq!(found.len(), 1, "a needle of 4.2 edges");
    let is_middle = |corner: &Vec3| (0.5 * (*corner + over(4.2))).distance(found[0]) < 1e-6;
    assert!(triangle.iter().any(is_middle), "{found:?}");
    // A square is no sliver, whatever its flat cells' spheres are.
    assert_eq!(of(&grid([4, 4, 4])), [], "a grid");
    assert_eq!(
        of(&[triangle.as_slice(), &[Vec3::new(0.5, 0.0, -0.8)]].concat()),
        [],
        "two triangles"
    );
    // A triangle of edges a, a, c has R = a²/(2h), which is more than 2 c if a > 3.9 c.
    let narrow = |a: f32| of(&[Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.0, (a * a - 0.25).sqrt())]);
    assert_eq!((narrow(3.8).len(), narrow(4.1).len()), (0, 1), "narrow triangles");
}
