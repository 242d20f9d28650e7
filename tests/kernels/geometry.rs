// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/geometry`.

use crate::harness::{KeepNan, Largest, Random, assert_each, map, map_with, storage};
use glam::{DVec2, DVec3, Vec3, Vec4};

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct RayTriangle {
    a: Vec3,
    t_min: f32,
    b: Vec3,
    t_max: f32,
    c: Vec3,
    pad: f32,
    origin: Vec3,
    pad_origin: f32,
    direction: Vec3,
    pad_direction: f32,
}

impl RayTriangle {
    fn new([a, b, c]: [Vec3; 3], origin: Vec3, direction: Vec3) -> Self {
        Self { a, b, c, origin, direction, t_max: f32::MAX, ..bytemuck::Zeroable::zeroed() }
    }

    fn exact(&self) -> [DVec3; 5] {
        [self.a, self.b, self.c, self.origin, self.direction].map(Vec3::as_dvec3)
    }
}

/// t and barycentrics; a miss has t ≥ t_max, here the largest f32 or less.
fn intersect(inputs: &[RayTriangle]) -> Vec<[f32; 4]> {
    map(
        "#import lucerna::geometry::ray_triangle::{shear_ray, intersect_triangle}
        struct Input { a: vec3<f32>, t_min: f32, b: vec3<f32>, t_max: f32, c: vec3<f32>, pad: f32, origin: vec3<f32>, pad_origin: f32, direction: vec3<f32>, pad_direction: f32 }
        alias Output = vec4<f32>;
        fn map(i: Input) -> vec4<f32> {
            let hit = intersect_triangle(shear_ray(i.origin, i.direction), i.a, i.b, i.c, i.t_min, i.t_max);
            return vec4<f32>(hit.t, hit.barycentrics, 0.0);
        }",
        inputs,
    )
}

/// T. Möller, B. Trumbore 1997, in f64: t and barycentrics, inside or not.
fn moller_trumbore([a, b, c, origin, direction]: [DVec3; 5]) -> Option<(f64, DVec2)> {
    let (e, f) = (b - a, c - a);
    let p = direction.cross(f);
    let determinant = e.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s = origin - a;
    let q = s.cross(e);
    Some((f.dot(q) / determinant, DVec2::new(s.dot(p), direction.dot(q)) / determinant))
}

/// Against f64, for triangles from 1e-3 to 1e3 hit and missed, from both sides.
///
/// With E the largest distance from the origin to a corner and 2A·cos the sheared triangle's double
/// area, an edge function errs by 40 roundings of E² (6 of each of 4 coordinates and its own), so
/// barycentrics by 2.4e-6·E²/(2A·cos) and t by three times that of E. Cases nearer to an edge than
/// this are left out.
#[test]
fn ray_triangle_matches_moller_trumbore() {
    let mut random = Random(51);
    let mut inputs = Vec::new();
    for i in 0..60_000 {
        let size = 10f32.powf(random.range(-3.0, 3.0));
        let corners = [(); 3].map(|()| random.direction() * (size * random.unit()));
        let origin = random.direction() * (size * random.range(0.2, 4.0));
        let (s, t) = (random.range(-0.4, 1.0), random.range(-0.4, 1.0));
        let target = corners[0] + (corners[1] - corners[0]) * s + (corners[2] - corners[0]) * t;
        let direction = match i % 4 {
            0 => random.direction(),
            1 => (target - origin).normalize(),
            _ => (target - origin) * 10f32.powf(random.range(-3.0, 3.0)),
        };
        inputs.push(RayTriangle::new(corners, origin, direction));
    }
    let (mut n_hits, mut n_misses) = (0, 0);
    for (input, [t, second, third, _]) in inputs.iter().zip(intersect(&inputs)) {
        let exact @ [a, b, c, origin, direction] = input.exact();
        let Some((expected_t, weights)) = moller_trumbore(exact) else { continue };
        let reach = [a, b, c].map(|p| (p - origin).length()).into_iter().fold(0.0, f64::max);
        let projected = (b - a).cross(c - a).dot(direction).abs() / direction.length();
        let error = 2.4e-6 * reach * reach / projected;
        let nearest = weights.x.min(weights.y).min(1.0 - weights.x - weights.y);
        let t_error = 3.0 * error * reach / direction.length();
        if error > 0.05 || nearest.abs() < error || expected_t.abs() < t_error {
            continue;
        }
        let what = format!("{input:?}");
        if nearest < 0.0 || expected_t < 0.0 {
            assert_eq!(
                t,
                f32::MAX,
                "{what}: t of a ray that misses (in f64 {expected_t}, weights {weights})"
            );
            n_misses += 1;
        } else {
            assert!(
                (f64::from(t) - expected_t).abs() < t_error,
                "{what}: t is {t}, expected {expected_t} within {t_error:.1e}"
            );
            let found = DVec2::new(f64::from(second), f64::from(third));
            assert!(
                (found - weights).largest() < error,
                "{what}: barycentrics are {found}, expected {weights} within {error:.1e}"
            );
            n_hits += 1;
        }
    }
    assert!(
        n_hits > 10_000 && n_misses > 10_000,
        "{n_hits} hits and {n_misses} misses are compared, expected above 10 000 of each"
    );
}

/// The interval is open, both faces count, zero area and edge-on do not, corners and edges do.
#[test]
fn ray_triangle_edge_cases() {
    let corners = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y * 2.0];
    let down = |x: f32, y: f32| RayTriangle::new(corners, Vec3::new(x, y, 4.0), Vec3::NEG_Z);
    let within = |t_min, t_max| RayTriangle { t_min, t_max, ..down(0.5, 0.5) };
    let flipped = [corners[0], corners[2], corners[1]];
    let point = |p| RayTriangle::new([p, p, p], Vec3::Z, Vec3::NEG_Z);
    let segment = [Vec3::NEG_X, Vec3::X, Vec3::X * 3.0];
    let cases = [
        (down(0.5, 0.5), Some([4.0, 0.25, 0.25])),
        (RayTriangle::new(flipped, Vec3::new(0.5, 1.0, 4.0), Vec3::NEG_Z), Some([4.0, 0.5, 0.25])),
        (
            RayTriangle::new(corners, Vec3::new(0.5, 0.5, -4.0), Vec3::Z * 8.0),
            Some([0.5, 0.25, 0.25]),
        ),
        (RayTriangle::new(corners, Vec3::new(0.5, 0.5, -4.0), Vec3::NEG_Z), None),
        (within(4.0, 5.0), None),
        (within(3.0, 4.0), None),
        (within(3.999, 4.001), Some([4.0, 0.25, 0.25])),
        (down(0.0, 0.0), Some([4.0, 0.0, 0.0])),
        (down(2.0, 0.0), Some([4.0, 1.0, 0.0])),
        (down(1.0, 1.0), Some([4.0, 0.5, 0.5])),
        (down(1.0, 0.0), Some([4.0, 0.5, 0.0])),
        (down(1.001, 1.0), None),
        (down(-0.001, 1.0), None),
        (RayTriangle::new(corners, Vec3::new(-1.0, 0.5, 0.0), Vec3::X), None),
        (RayTriangle::new(corners, Vec3::new(0.5, 0.5, 0.0), Vec3::new(0.3, 0.4, 0.5)), None),
        (point(Vec3::ZERO), None),
        (RayTriangle::new(segment, Vec3::Z, Vec3::NEG_Z), None),
    ];
    let outputs = intersect(&cases.map(|case| case.0));
    for ((input, expected), [t, second, third, _]) in cases.iter().zip(outputs) {
        match expected {
            Some(hit) => assert_eq!([t, second, third], *hit, "{input:?}: t and barycentrics"),
            None => {
                assert!(
                    t > 3e38 && t >= input.t_max,
                    "{input:?}: t of a miss is {t}, expected above 3e38 and t_max"
                );
                assert_eq!([second, third], [0.0; 2], "{input:?}: barycentrics of a miss");
            }
        }
    }
}

struct Mesh {
    name: &'static str,
    vertices: Vec<Vec3>,
    triangles: Vec<[usize; 3]>,
    centre: Vec3,
    /// Every point this near to the centre lies inside.
    inner_radius: f32,
}

impl Mesh {
    fn icosphere(levels: usize) -> Self {
        let g = (1.0 + 5f64.sqrt()) / 2.0;
        let mut vertices = Vec::new();
        for (s, t) in [(-1.0, -g), (-1.0, g), (1.0, -g), (1.0, g)] {
            vertices.extend([DVec3::new(0.0, s, t), DVec3::new(s, t, 0.0), DVec3::new(t, 0.0, s)]);
        }
        let mut vertices: Vec<DVec3> = vertices.into_iter().map(DVec3::normalize).collect();
        // Three corners at mutual distance of an edge are a face.
        let edge = (0..12).map(|i| if i == 0 { 9.0 } else { vertices[0].distance(vertices[i]) });
        let edge = edge.fold(9.0, f64::min) * 1.01;
        let mut triangles = Vec::new();
        for i in 0..12 {
            for j in 0..i {
                for k in 0..j {
                    let [a, b, c] = [vertices[i], vertices[j], vertices[k]];
                    if a.distance(b) < edge && b.distance(c) < edge && c.distance(a) < edge {
                        triangles.push([i, j, k]);
                    }
                }
            }
        }
        for _ in 0..levels {
            let mut middles = std::collections::HashMap::new();
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    vertices.push((vertices[i] + vertices[j]).normalize());
                    vertices.len() - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[i, j, k]| {
                    let (p, q, r) = (middle(i, j), middle(j, k), middle(k, i));
                    [[i, p, r], [p, j, q], [r, q, k], [p, q, r]]
                })
                .collect();
        }
        let vertices = vertices.iter().map(|v| v.as_vec3()).collect();
        Self { name: "icosphere", vertices, triangles, centre: Vec3::ZERO, inner_radius: 0.9 }
    }

    /// The surface of [−1, 1]³ in n × n quads a side; vertices move by `jitter` of a cell.
    fn cube(n: usize, jitter: f32) -> Self {
        let mut random = Random(52);
        let mut vertices: Vec<Vec3> = Vec::new();
        let mut known = std::collections::HashMap::new();
        let mut triangles = Vec::new();
        for side in 0..6 {
            let mut corner = |i: usize, j: usize| {
                let (mut key, axis) = ([0; 3], side / 2);
                key[axis] = side % 2 * n;
                key[(axis + 1) % 3] = i;
                key[(axis + 2) % 3] = j;
                *known.entry(key).or_insert_with(|| {
                    let at = Vec3::from(key.map(|k| k as f32)) * (2.0 / n as f32) - 1.0;
                    let mut move_by = || random.range(-jitter, jitter) * 2.0 / n as f32;
                    vertices.push(at + Vec3::new(move_by(), move_by(), move_by()));
                    vertices.len() - 1
                })
            };
            for i in 0..n {
                for j in 0..n {
                    let [a, b, c, d] =
                        [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        let inner_radius = 1.0 - jitter * 3.5 / n as f32;
        Self { name: "cube", vertices, triangles, centre: Vec3::ZERO, inner_radius }
    }

    fn moved(mut self, name: &'static str, scale: Vec3, offset: Vec3) -> Self {
        self.name = name;
        self.vertices.iter_mut().for_each(|v| *v = *v * scale + offset);
        self.centre = offset;
        self.inner_radius *= scale.min_element() * 0.99;
        self
    }

    /// Rays from inside at corners and at points of edges.
    fn rays(&self, n: usize, seed: u64) -> Vec<[Vec4; 2]> {
        let mut random = Random(seed);
        let mut pick = |n: usize| (random.bits() % n as u64) as usize;
        let picks: Vec<_> =
            (0..n).map(|_| [pick(self.triangles.len()), pick(3), pick(8)]).collect();
        let mut out = Vec::with_capacity(n);
        for [triangle, corner, kind] in picks {
            let [a, b] = [corner, (corner + 1) % 3]
                .map(|k| self.vertices[self.triangles[triangle][k]].as_dvec3());
            let s = match kind {
                0 | 1 => 0.0,
                2 => 0.5,
                3 => f64::from(random.unit()) * 1e-6,
                _ => f64::from(random.unit()),
            };
            let target = a.lerp(b, s);
            let origin = match kind {
                // On a line of the grid with the target: ties of exact numbers.
                1 => Vec3::new(target.x as f32, target.y as f32, self.centre.z),
                2 => self.centre,
                _ => self.centre + random.direction() * (self.inner_radius * random.unit()),
            };
            let origin = if (origin - self.centre).length() < self.inner_radius {
                origin
            } else {
                self.centre
            };
            let mut direction = target - origin.as_dvec3();
            if kind % 2 == 0 {
                direction = direction.normalize();
            }
            out.push([origin.extend(0.0), direction.as_vec3().extend(0.0)]);
        }
        out
    }
}

/// A closed mesh lets no ray out: 1.1 million rays from inside, aimed at corners and edges (in f64,
/// rounded), hit at least one triangle, on 8 meshes.
#[test]
fn ray_triangle_is_watertight() {
    let thin = Vec3::new(1.0, 1e-2, 1.0);
    let meshes = [
        Mesh::icosphere(2),
        Mesh::icosphere(1).moved("icosphere at 1e3", Vec3::ONE, Vec3::new(1e3, -1e3, 1e3)),
        Mesh::icosphere(1).moved("tiny icosphere", Vec3::splat(1e-3), Vec3::ZERO),
        Mesh::icosphere(1).moved("flat icosphere", thin, Vec3::new(0.1, 0.0, -0.3)),
        Mesh::cube(4, 0.0),
        Mesh::cube(5, 0.2),
        Mesh::cube(4, 0.2).moved("tiny cube at 10", Vec3::splat(1e-3), Vec3::splat(10.0)),
        Mesh::cube(4, 0.2).moved("huge cube", Vec3::splat(1e6), Vec3::new(1e3, 0.0, 0.0)),
    ];
    let mut n_rays = 0;
    for (ix, mesh) in meshes.iter().enumerate() {
        let rays = mesh.rays(140_000, 53 + ix as u64);
        n_rays += rays.len();
        let corners: Vec<Vec4> =
            mesh.triangles.iter().flatten().map(|&i| mesh.vertices[i].extend(0.0)).collect();
        let buffer = storage(bytemuck::cast_slice(&corners));
        let counts: Vec<u32> = map_with(
            "#import lucerna::geometry::ray_triangle::{shear_ray, intersect_triangle}
            #import lucerna::math::constants::FLOAT_MAX
            @group(0) @binding(2) var<storage, read> corners: array<vec4<f32>>;
            struct Input { origin: vec4<f32>, direction: vec4<f32> }
            alias Output = u32;
            fn map(input: Input) -> u32 {
                let ray = shear_ray(input.origin.xyz, input.direction.xyz);
                var n = 0u;
                for (var i = 0u; i < arrayLength(&corners); i += 3u) {
                    let hit = intersect_triangle(ray, corners[i].xyz, corners[i + 1u].xyz, corners[i + 2u].xyz, 0.0, FLOAT_MAX);
                    n += select(0u, 1u, hit.t < FLOAT_MAX);
                }
                return n;
            }",
            &rays,
            &[wgpu::BindGroupEntry { binding: 2, resource: buffer.as_entire_binding() }],
        );
        let leaks: Vec<_> = rays.iter().zip(&counts).filter(|(_, n)| **n == 0).collect();
        assert!(
            leaks.is_empty(),
            "{}: {} of {} rays leave the closed mesh, expected none; the first is {:?}",
            mesh.name,
            leaks.len(),
            rays.len(),
            leaks[0].0
        );
        // Aimed at what triangles share, many rays tie.
        let shared = counts.iter().filter(|n| **n > 1).count();
        eprintln!("{}: {} rays, {shared} hit several triangles", mesh.name, rays.len());
    }
    assert!(n_rays >= 1_000_000, "{n_rays} rays, expected at least 1 000 000");
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct RayBox {
    min: Vec3,
    pad_min: f32,
    max: Vec3,
    pad_max: f32,
    origin: Vec3,
    pad_origin: f32,
    direction: Vec3,
    pad_direction: f32,
}

fn intersect_boxes(inputs: &[RayBox]) -> Vec<[f32; 2]> {
    map(
        "#import lucerna::geometry::ray_box::{safe_inverse_direction, intersect_box}
        struct Input { low: vec4<f32>, high: vec4<f32>, origin: vec4<f32>, direction: vec4<f32> }
        alias Output = vec2<f32>;
        fn map(i: Input) -> vec2<f32> {
            return intersect_box(i.origin.xyz, safe_inverse_direction(i.direction.xyz), i.low.xyz, i.high.xyz);
        }",
        inputs,
    )
}

fn ray_box(low: [f32; 3], high: [f32; 3], origin: [f32; 3], direction: [f32; 3]) -> RayBox {
    RayBox {
        min: low.into(),
        max: high.into(),
        origin: origin.into(),
        direction: direction.into(),
        ..bytemuck::Zeroable::zeroed()
    }
}

/// Entry and exit of the line in f64; an axis that the ray does not move along is all or nothing.
fn exact_box(i: &RayBox) -> Option<(f64, f64)> {
    let (mut entry, mut exit) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..3 {
        let [low, high, origin, direction] =
            [i.min, i.max, i.origin, i.direction].map(|v| f64::from(v[axis]));
        if direction == 0.0 {
            if origin < low || origin > high {
                return None;
            }
            continue;
        }
        let (s, t) = ((low - origin) / direction, (high - origin) / direction);
        entry = entry.max(s.min(t));
        exit = exit.min(s.max(t));
    }
    Some((entry, exit))
}

/// Never misses a box that the exact ray meets (f64; gaps below 1e-13 are not told from touching),
/// and misses those that it passes by more than the slack of 1e-6: 50 000 boxes, flat ones and rays
/// along axes and within faces among them. Touching by exact numbers counts.
#[test]
fn ray_box_is_conservative_and_right() {
    let mut random = Random(61);
    let mut inputs = Vec::new();
    for i in 0..50_000 {
        let scale = 10f32.powf(random.range(-3.0, 3.0));
        let shift = random.direction() * [0.0, scale, 100.0 * scale][i % 3];
        let (p, q) = (random.direction() * scale + shift, random.direction() * scale + shift);
        let (min, mut max) = (p.min(q), p.max(q));
        if i % 5 == 0 {
            max[i % 3] = min[i % 3];
        }
        let mut origin = shift + random.direction() * (3.0 * scale * random.unit());
        // At a point of the box's surface, often a corner, or anywhere.
        let mut target = Vec3::ZERO;
        for axis in 0..3 {
            let s =
                [0.0, 1.0, random.unit(), random.range(-0.5, 1.5)][(random.bits() % 4) as usize];
            target[axis] = min[axis] + (max[axis] - min[axis]) * s;
        }
        if random.bits().is_multiple_of(4) {
            let axis = (random.bits() % 3) as usize;
            origin[axis] = [min, max, target][(random.bits() % 3) as usize][axis];
            target[axis] = origin[axis];
        }
        let mut direction = (target - origin) * 10f32.powf(random.range(-2.0, 2.0));
        if i % 7 == 0 {
            direction[i % 3] = [0.0, -0.0, 1e-30, -1e-30][(random.bits() % 4) as usize];
        }
        if direction != Vec3::ZERO {
            inputs.push(RayBox { min, max, origin, direction, ..bytemuck::Zeroable::zeroed() });
        }
    }
    let (mut n_hits, mut n_misses) = (0, 0);
    for (input, [entry, exit]) in inputs.iter().zip(intersect_boxes(&inputs)) {
        let hit = entry.max(0.0) <= exit;
        let what =
            format!("{input:?}: the interval is [{entry}, {exit}], exact {:?}", exact_box(input));
        // Directions too small to be inverted are read as 0 or 1e-20.
        if input.direction.abs().cmplt(Vec3::splat(1e-19)).any()
            && input.direction.cmpne(Vec3::ZERO).all()
        {
            let still = |v: Vec3| Vec3::select(v.abs().cmplt(Vec3::splat(1e-19)), Vec3::ZERO, v);
            let near = RayBox { direction: still(input.direction), ..*input };
            let met = exact_box(&near).is_some_and(|(s, t)| s.max(0.0) <= t);
            assert!(
                hit || !met,
                "{what}: misses a box that the ray meets with small parts of its direction read as 0"
            );
            continue;
        }
        match exact_box(input) {
            Some((s, t)) if s.max(0.0) <= t - 1e-13 * t.abs() => {
                assert!(hit, "{what}: misses a box that the ray meets");
                n_hits += 1;
            }
            Some((s, t)) if s.max(0.0) > t + 1e-6 * (s.abs() + t.abs()) => {
                assert!(!hit, "{what}: hits a box that the ray passes by");
                n_misses += 1;
            }
            None => {
                assert!(!hit, "{what}: hits a box that the ray passes by");
                n_misses += 1;
            }
            _ => {}
        }
    }
    assert!(
        n_hits > 10_000 && n_misses > 5_000,
        "{n_hits} hits and {n_misses} misses are compared, expected above 10 000 and 5 000"
    );
}

/// Rays by exact numbers that touch a corner, run within a face or an edge, start on or inside the
/// box, meet a flat box, and such as just do not.
#[test]
fn ray_box_edge_cases() {
    let (low, high) = ([0.0; 3], [1.0, 2.0, 4.0]);
    let cases = [
        (ray_box(low, high, [-1.0, 1.0, 1.0], [1.0, 0.0, 0.0]), true),
        (ray_box(low, high, [-1.0, 1.0, 1.0], [-1.0, 0.0, 0.0]), false),
        // Within faces, from outside and along them.
        (ray_box(low, high, [-1.0, 2.0, 1.0], [1.0, 0.0, 0.0]), true),
        (ray_box(low, high, [-1.0, 2.0, 1.0], [1.0, -0.0, 0.0]), true),
        (ray_box(low, high, [-1.0, 0.0, 1.0], [1.0, 0.0, 0.0]), true),
        (ray_box(low, high, [-1.0, 0.0, 1.0], [1.0, -0.0, -0.0]), true),
        (ray_box(low, high, [-1.0, 2.0, 4.0], [1.0, 0.0, 0.0]), true),
        (ray_box(low, high, [-1.0, 2.000_000_2, 4.0], [1.0, 0.0, 0.0]), false),
        (ray_box(low, high, [1.0, 2.0, 4.0], [0.0, 0.0, 1.0]), true),
        (ray_box(low, high, [1.0, 2.0, 4.0], [1.0, 1.0, 1.0]), true),
        (ray_box(low, high, [0.5, 1.0, 3.0], [0.1, 0.2, 0.3]), true),
        // Through a corner.
        (ray_box(low, high, [0.0, 3.0, 4.0], [1.0, -1.0, 0.0]), true),
        (ray_box(low, high, [2.0, 1.0, 1.0], [-1.0, 1.0, 1.0]), true),
        (ray_box(low, high, [2.0, 1.001, 1.0], [-1.0, 1.0, 1.0]), false),
        // Flat.
        (ray_box([0.0, 1.0, 0.0], [1.0; 3], [0.5, 9.0, 0.5], [0.0, -1.0, 0.0]), true),
        (ray_box([0.0, 1.0, 0.0], [1.0; 3], [-1.0, 1.0, 0.5], [1.0, 0.0, 0.0]), true),
        (ray_box([1.0; 3], [1.0; 3], [0.0; 3], [1.0; 3]), true),
        (ray_box([1.0; 3], [1.0; 3], [2.0; 3], [1.0; 3]), false),
    ];
    let outputs = intersect_boxes(&cases.map(|case| case.0));
    for ((input, expected), [entry, exit]) in cases.iter().zip(outputs) {
        assert_eq!(
            entry.max(0.0) <= exit,
            *expected,
            "{input:?}: whether the ray meets the box, by the interval [{entry}, {exit}]"
        );
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct TriangleBox {
    corners: [Vec4; 3],
    center: Vec4,
    half_size: Vec4,
}

fn overlaps(inputs: &[TriangleBox]) -> Vec<u32> {
    map(
        "#import lucerna::geometry::triangle_box::triangle_overlaps_box
        struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, center: vec4<f32>, half_size: vec4<f32> }
        alias Output = u32;
        fn map(i: Input) -> u32 {
            return u32(triangle_overlaps_box(i.a.xyz, i.b.xyz, i.c.xyz, i.center.xyz, i.half_size.xyz));
        }",
        inputs,
    )
}

/// The 13 axes in f64, one after the other: exact on small integers. Axes of no length separate
/// nothing.
fn separated(corners: [DVec3; 3], half: DVec3) -> bool {
    let [a, b, c] = corners;
    let edges = [b - a, c - b, a - c];
    let mut axes = vec![DVec3::X, DVec3::Y, DVec3::Z, edges[0].cross(edges[1])];
    for edge in edges {
        axes.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis.cross(edge)));
    }
    axes.into_iter().any(|axis| {
        let reach = half.dot(axis.abs());
        let at = corners.map(|p| p.dot(axis));
        at.into_iter().fold(f64::MAX, f64::min) > reach
            || at.into_iter().fold(f64::MIN, f64::max) < -reach
    })
}

/// Whether anything of the triangle is left after cutting it by the box's six planes (Sutherland &
/// Hodgman), in f64.
fn clipped_remains(corners: [DVec3; 3], half: DVec3) -> bool {
    let mut polygon = corners.to_vec();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let depth = |p: DVec3| half[axis] - side * p[axis];
            let mut kept = Vec::new();
            for (i, &p) in polygon.iter().enumerate() {
                let q = polygon[(i + 1) % polygon.len()];
                if depth(p) >= 0.0 {
                    kept.push(p);
                }
                if (depth(p) >= 0.0) != (depth(q) >= 0.0) {
                    kept.push(p.lerp(q, depth(p) / (depth(p) - depth(q))));
                }
            }
            polygon = kept;
        }
    }
    !polygon.is_empty()
}

/// Exactly the f64 answer where all numbers are small integers: touching corners, edges and faces,
/// and triangles without area.
#[test]
fn triangle_box_is_exact_on_integers() {
    let mut random = Random(71);
    let mut inputs = Vec::new();
    for i in 0..40_000 {
        let span = [3, 5, 9][i % 3];
        let mut next = || ((random.bits() % (2 * span + 1)) as f32) - span as f32;
        let mut point = || Vec4::new(next(), next(), next(), 0.0);
        let center = point();
        let mut corners = [point() + center, point() + center, point() + center];
        match i % 11 {
            0 => corners[1] = corners[0],
            1 => corners[2] = 2.0 * corners[1] - corners[0],
            _ => {}
        }
        let half_size = [Vec4::ONE, Vec4::new(2.0, 1.0, 3.0, 0.0), point().abs()][i / 3 % 3];
        inputs.push(TriangleBox { corners, center, half_size });
    }
    let outputs = overlaps(&inputs);
    let n_overlaps = outputs.iter().filter(|o| **o == 1).count();
    assert!(
        (10_000..35_000).contains(&n_overlaps),
        "{n_overlaps} of {} triangles overlap, expected 10 000 to 35 000",
        inputs.len()
    );
    let mut n_touching = 0;
    for (input, output) in inputs.iter().zip(outputs) {
        let corners = input.corners.map(|p| (p - input.center).truncate().as_dvec3());
        let half = input.half_size.truncate().as_dvec3();
        assert_eq!(
            output == 1,
            !separated(corners, half),
            "{input:?}: whether triangle and box overlap, by the kernel (left) and by 13 axes in f64"
        );
        let smaller = half - 1e-9;
        n_touching += usize::from(output == 1 && !clipped_remains(corners, smaller));
    }
    assert!(n_touching > 1000, "{n_touching} triangles only touch their box, expected above 1000");
}

/// Against clipping in f64, with the box a little smaller and a little larger: where both say the
/// same, so does the kernel. The margin is 16 roundings of the coordinates, times how flat the
/// triangle is (its normal's error).
#[test]
fn triangle_box_matches_clipping() {
    let mut random = Random(72);
    let mut inputs = Vec::new();
    for i in 0..60_000 {
        let scale = 10f32.powf(random.range(-3.0, 3.0));
        let center = random.direction() * scale * [0.0, 1.0, 30.0][i % 3];
        let size = scale * 10f32.powf(random.range(-1.0, 0.5));
        let near = center + random.direction() * scale * random.unit();
        let mut point = || (near + random.direction() * (size * random.unit())).extend(0.0);
        let corners = [point(), point(), point()];
        let half = (random.direction().abs() * (0.7 * scale)).extend(0.0);
        inputs.push(TriangleBox { corners, center: center.extend(0.0), half_size: half });
    }
    let mut counts = [0, 0];
    for (input, output) in inputs.iter().zip(overlaps(&inputs)) {
        let center = input.center.truncate().as_dvec3();
        let corners @ [a, b, c] = input.corners.map(|p| p.truncate().as_dvec3() - center);
        let half = input.half_size.truncate().as_dvec3();
        let flatness = (b - a).length() * (c - a).length() / (b - a).cross(c - a).length();
        let size = corners.iter().map(|p| p.length()).fold(half.length(), f64::max);
        let margin = DVec3::splat(1e-6 * size * flatness);
        let (less, more) =
            (clipped_remains(corners, half - margin), clipped_remains(corners, half + margin));
        if less == more {
            assert_eq!(
                output == 1,
                more,
                "{input:?}: whether triangle and box overlap, by the kernel (left) and by clipping in f64"
            );
            counts[usize::from(more)] += 1;
        }
    }
    assert!(
        counts[0] > 10_000 && counts[1] > 10_000,
        "{} triangles beside and {} in their box are compared, expected above 10 000 of each",
        counts[0],
        counts[1]
    );
}

/// Interpolation in f64 (7 roundings of the largest term), and the weights of a point again: 8
/// roundings times the triangle's flatness.
#[test]
fn barycentrics_match_f64_and_round_trip() {
    let mut random = Random(81);
    let mut inputs: Vec<[Vec4; 4]> = Vec::new();
    for i in 0..20_000 {
        let scale = 10f32.powf(random.range(-3.0, 3.0));
        let mut point = || (random.direction() * (scale * random.unit())).extend(0.0);
        let corners = [point(), point(), point()];
        let (mut s, mut t) = (random.unit(), random.unit());
        if s + t > 1.0 {
            (s, t) = (1.0 - s, 1.0 - t);
        }
        let (s, t) = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (s, t)][i.min(4)];
        inputs.push([corners[0], corners[1], corners[2], Vec4::new(s, t, random.unit(), scale)]);
    }
    let outputs: Vec<[Vec4; 4]> = map(
        "#import lucerna::geometry::barycentric::{interpolate_vec2, interpolate_vec3, interpolate_vec4, barycentrics_of}
        struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, w: vec4<f32> }
        struct Output { three: vec4<f32>, two: vec4<f32>, four: vec4<f32>, weights: vec4<f32> }
        fn map(i: Input) -> Output {
            let p = interpolate_vec3(i.a.xyz, i.b.xyz, i.c.xyz, i.w.xy);
            // Off the plane by a quarter of the scale: the weights are those of the projection.
            let off = normalize(cross(i.b.xyz - i.a.xyz, i.c.xyz - i.a.xyz)) * (0.25 * i.w.w);
            return Output(
                vec4<f32>(p, 0.0),
                vec4<f32>(interpolate_vec2(i.a.xy, i.b.xy, i.c.xy, i.w.xy), 0.0, 0.0),
                interpolate_vec4(i.a.zxyz, i.b.zxyz, i.c.zxyz, i.w.xy),
                vec4<f32>(barycentrics_of(p, i.a.xyz, i.b.xyz, i.c.xyz), barycentrics_of(p + off, i.a.xyz, i.b.xyz, i.c.xyz)),
            );
        }",
        &inputs,
    );
    for ([a, b, c, w], [three, two, four, weights]) in inputs.iter().zip(&outputs) {
        let [a, b, c] = [a, b, c].map(|p| p.truncate().as_dvec3());
        let (s, t) = (f64::from(w.x), f64::from(w.y));
        let expected = a * (1.0 - s - t) + b * s + c * t;
        let largest = a.abs().max(b.abs()).max(c.abs());
        let what = format!("corners {a}, {b}, {c}, weights {s}, {t}");
        for axis in 0..3 {
            let bound = 4.2e-7 * largest[axis] + 1e-30;
            assert!(
                (f64::from(three[axis]) - expected[axis]).abs() <= bound,
                "{what}: interpolated is {three}, expected {expected} within {bound:.1e} in axis {axis}"
            );
        }
        assert_eq!(
            two.truncate().truncate(),
            three.truncate().truncate(),
            "{what}: interpolated pair, expected the triple's"
        );
        assert_eq!(
            *four,
            Vec4::new(three.z, three.x, three.y, three.z),
            "{what}: interpolated four (z, x, y, z), expected the triple's"
        );
        let cross = (b - a).cross(c - a).length();
        let longest = (b - a).length().max((c - a).length());
        // The point off the plane is known to 1e-7 of its coordinates.
        let reach = longest + 4.0 * f64::from(w.w);
        let error = 1e-6 * longest * reach / cross;
        // The normal's own tilt moves the projection of the point off the plane.
        let tilt = 4.0 * error * f64::from(w.w) / longest * (longest * longest / cross);
        if error + tilt < 0.05 {
            for (found, expected) in [(weights.x, s), (weights.y, t)] {
                assert!(
                    (f64::from(found) - expected).abs() < error,
                    "{what}: the weight of the point comes back as {found}, expected {expected} within {error:.1e}"
                );
            }
            for (found, expected) in [(weights.z, s), (weights.w, t)] {
                assert!(
                    (f64::from(found) - expected).abs() < error + tilt,
                    "{what}: the weight of a point off the plane is {found}, expected {expected} within {:.1e}",
                    error + tilt
                );
            }
        }
    }
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct OffsetInput {
    a: Vec3,
    u: f32,
    b: Vec3,
    v: f32,
    c: Vec3,
    pad: f32,
    direction: Vec3,
    pad_direction: f32,
}

/// Triangles of 1 mm to 1 km, at the origin to 10 km away, in planes through the origin and in
/// coordinate planes too; directions to both sides, a third of them nearly along the surface.
fn offset_inputs(n: usize) -> Vec<OffsetInput> {
    let mut random = Random(91);
    let mut out = Vec::with_capacity(n);
    while out.len() < n {
        let i = out.len();
        let size = 10f32.powf(random.range(-3.0, 3.0));
        let distance = [0.0, size, 1.0, 10f32.powf(random.range(-2.0, 4.0))][i % 4];
        let at = random.direction() * distance;
        let mut corners = [(); 3].map(|()| at + random.direction() * (size * random.unit()));
        if i % 5 == 0 {
            let axis = i / 5 % 3;
            let level = [0.0, corners[0][axis]][i / 15 % 2];
            corners.iter_mut().for_each(|corner| corner[axis] = level);
        }
        let [a, b, c] = corners;
        let (p, q) = ((b - a).as_dvec3(), (c - a).as_dvec3());
        let cross = p.cross(q);
        // What f32 still knows as a triangle: height above 1e-3 of its length.
        if cross.length() < 1e-3 * p.length_squared().max(q.length_squared())
            || cross.length() == 0.0
        {
            continue;
        }
        let (mut u, mut v) = (random.unit(), random.unit());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        if i % 9 == 0 {
            u = 0.0;
        }
        let mut direction = random.direction();
        if i % 3 == 0 {
            let normal = cross.normalize();
            let d = direction.as_dvec3();
            let height = 10f64.powf(f64::from(random.range(-4.0, 0.0)));
            let flat = (d - normal * normal.dot(d)).normalize();
            direction = (flat + normal * height * normal.dot(d).signum()).normalize().as_vec3();
        }
        out.push(OffsetInput { a, b, c, u, v, direction, pad: 0.0, pad_direction: 0.0 });
    }
    out
}

/// From the offset point of 400 000 surface points no ray meets its own triangle again with t_min 0
/// (longest edge² up to 100 times twice the area; of slivers beyond, up to 1000 and more, at most 1
/// in 100 000 does), and the offset is at most 3·6e-8·(16·P + 32·S) for coordinates up to P and a
/// triangle of extent S: a wall farther than that is not skipped.
#[test]
fn ray_offset_leaves_its_own_triangle() {
    let inputs = offset_inputs(400_000);
    let outputs: Vec<Vec4> = map(
        "#import lucerna::geometry::ray_offset::{interpolation_error, offset_ray_origin}
        #import lucerna::geometry::ray_triangle::{shear_ray, intersect_triangle}
        #import lucerna::geometry::barycentric::interpolate_vec3
        #import lucerna::math::constants::FLOAT_MAX
        #import lucerna::math::vector::safe_normalize
        struct Input { a: vec3<f32>, u: f32, b: vec3<f32>, v: f32, c: vec3<f32>, pad: f32, direction: vec3<f32>, pad_direction: f32 }
        alias Output = vec4<f32>;
        fn map(i: Input) -> vec4<f32> {
            let position = interpolate_vec3(i.a, i.b, i.c, vec2<f32>(i.u, i.v));
            let normal = safe_normalize(cross(i.b - i.a, i.c - i.a), vec3<f32>(0.0, 1.0, 0.0));
            let origin = offset_ray_origin(position, interpolation_error(i.a, i.b, i.c), normal, i.direction);
            let hit = intersect_triangle(shear_ray(origin, i.direction), i.a, i.b, i.c, 0.0, FLOAT_MAX);
            return vec4<f32>(origin, select(-1.0, hit.t, hit.t < FLOAT_MAX));
        }",
        &inputs,
    );
    let mut n_hits = 0;
    let mut worst = 0.0f64;
    for (input, output) in inputs.iter().zip(&outputs) {
        let [a, b, c] = [input.a, input.b, input.c].map(Vec3::as_dvec3);
        let (u, v) = (f64::from(input.u), f64::from(input.v));
        let exact = a * (1.0 - u - v) + b * u + c * v;
        let moved = (output.truncate().as_dvec3() - exact).length();
        let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
        let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
        let bound = 3.0 * 6e-8 * (16.0 * largest + 32.0 * extent);
        worst = worst.max_nan(moved / bound);
        assert!(
            moved < bound,
            "{input:?}: the origin is moved by {moved:e}, expected below {bound:e}"
        );
        if output.w >= 0.0 {
            let longest = (b - a).length().max((c - a).length()).max((c - b).length());
            let sliver = longest * longest / (b - a).cross(c - a).length();
            assert!(
                sliver > 100.0,
                "{input:?}: a ray from {output}, moved by {moved:e}, meets its own triangle of longest edge²/double area {sliver}, expected only above 100"
            );
            n_hits += 1;
        }
    }
    eprintln!("ray offset: {n_hits} self hits, at most {worst:.3} of the bound");
    assert!(
        n_hits * 100_000 <= inputs.len(),
        "{n_hits} of {} rays meet their own triangle, expected at most 1 in 100 000",
        inputs.len()
    );
}

/// Weights within the triangle, for any point: those of its plane clamped each to [0, 1] and scaled to a sum of at most 1, in f64; of triangles
/// without area, numbers in the same range. Tolerance: 100 roundings over the sine of the angle at `a`, squared, times the distance.
#[test]
fn barycentrics_within_stay_within() {
    let mut random = Random(71);
    let mut inputs: Vec<[Vec4; 4]> = (0..10_000)
        .map(|_| {
            let mut corner = || (random.range(0.2, 1.0) * random.direction()).extend(0.0);
            [corner(), corner(), corner(), 2.0 * corner()]
        })
        .collect();
    let n = inputs.len();
    inputs.extend([[Vec4::ONE; 4], [Vec4::ZERO, Vec4::X, 2.0 * Vec4::X, Vec4::Y]]);
    let found: Vec<[f32; 2]> = map(
        "#import lucerna::geometry::barycentric::barycentrics_within
         struct Input { a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, p: vec4<f32> }
         struct Output { weights: vec2<f32> }
         fn map(x: Input) -> Output { return Output(barycentrics_within(x.p.xyz, x.a.xyz, x.b.xyz, x.c.xyz)); }",
        &inputs,
    );
    for (ix, ([a, b, c, p], found)) in inputs.iter().zip(&found).enumerate() {
        let what = format!("corners {a}, {b}, {c}, point {p}");
        assert_each(&format!("{what}: weights"), found, "within 0 to 1", |w| {
            (0.0..=1.0).contains(w)
        });
        assert!(
            found[0] + found[1] <= 1.0 + 2e-7,
            "{what}: the weights {found:?} sum to {}, expected at most 1 + 2e-7",
            found[0] + found[1]
        );
        let [a, b, c, p] = [a, b, c, p].map(|v| v.truncate().as_dvec3());
        let (e, f) = (b - a, c - a);
        let normal = e.cross(f);
        let sine = normal.length() / (e.length() * f.length());
        if ix >= n || sine < 0.02 {
            continue;
        }
        // Dual vectors of the edges.
        let plane = DVec2::new(f.cross(normal).dot(p - a), normal.cross(e).dot(p - a))
            / normal.length_squared();
        let clamped = plane.clamp(DVec2::ZERO, DVec2::ONE);
        let expected = clamped / (clamped.x + clamped.y).max(1.0);
        let shortest = e.length().min(f.length());
        let bound = 100.0 * 6e-8 / (sine * sine * shortest * shortest) + 1e-6;
        let error = (DVec2::new(found[0].into(), found[1].into()) - expected).length();
        assert!(
            error < bound,
            "{what}: weights are {found:?}, expected {expected} within {bound:.1e}"
        );
    }
}
