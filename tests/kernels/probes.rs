// SPDX-License-Identifier: MIT OR Apache-2.0
//! Probes: their maps, their weights, where they are, how far they see and what light they find, against f64.

use crate::harness::{Random, assert_each, gpu, map, read, submit};
use glam::{DVec2, DVec3, IVec3, UVec3, Vec3};
use lucerna::components::probes::{COEFFICIENTS, MAP_SIDE, ProbeSettings, ProbeVisibility, Probes};
use lucerna::components::voxels::{
    Resolution, Triangles, VoxelCounts, Voxelizer, grid_for_bounds, n_bricks,
};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Light, Material, Mesh, Scene, Sky};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use std::collections::HashSet;
use std::f64::consts::PI;

/// The octahedral mapping of a point of [−1, 1]², in f64.
fn direction_of(point: DVec2) -> DVec3 {
    let z = 1.0 - point.x.abs() - point.y.abs();
    let fold = (-z).max(0.0);
    let sign = |x: f64| if x >= 0.0 { 1.0 } else { -1.0 };
    DVec3::new(point.x - fold * sign(point.x), point.y - fold * sign(point.y), z).normalize()
}

/// The direction of a point of a texel; (0.5, 0.5): its middle.
fn direction_of_texel(texel: u32, inside: DVec2) -> DVec3 {
    let corner = DVec2::new((texel % MAP_SIDE).into(), (texel / MAP_SIDE).into());
    direction_of((corner + inside) / f64::from(MAP_SIDE) * 2.0 - 1.0)
}

/// The four texels around a direction lie around it, over all folds: none is farther than 0.95 (0.88 is the most inside the map, by a
/// search in f64; a wrong fold is off by more than 1), and their weighted mean is within 0.2 of it. In the middle of a texel, it is
/// the only one.
#[test]
fn taps_surround_their_direction() {
    let mut random = Random(5);
    let mut inputs: Vec<Vec3> = (0..4000).map(|_| random.direction()).collect();
    // Near the folds, which are where a component is 0 below, and at the corners of the square.
    for ix in 0..1000 {
        let mut near = random.direction();
        near[ix % 2] *= 1e-3;
        near.z = -near.z.abs();
        inputs.push(near.normalize());
    }
    inputs.extend([Vec3::NEG_Z, Vec3::new(1e-4, 1e-4, -1.0), Vec3::new(-1e-4, 1e-4, -1.0)]);
    let n_random = inputs.len();
    inputs.extend(
        (0..MAP_SIDE * MAP_SIDE).map(|t| direction_of_texel(t, DVec2::splat(0.5)).as_vec3()),
    );
    let inputs: Vec<[f32; 4]> = inputs.iter().map(|d| d.extend(0.0).to_array()).collect();
    let found: Vec<[f32; 8]> = map(
        "#import lucerna::components::probes::octahedral_map::map_taps
         alias Input = vec4<f32>;
         struct Output { texels: vec4<f32>, weights: vec4<f32> }
         fn map(x: Input) -> Output {
             let taps = map_taps(x.xyz);
             return Output(vec4<f32>(taps.texels), taps.weights);
         }",
        &inputs,
    );
    for (ix, (input, taps)) in inputs.iter().zip(&found).enumerate() {
        let direction = Vec3::from_slice(input).as_dvec3().normalize();
        let (texels, weights) = taps.split_at(4);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6, "{direction}: {weights:?}");
        let mut mean = DVec3::ZERO;
        for (texel, weight) in texels.iter().zip(weights) {
            let middle = direction_of_texel(*texel as u32, DVec2::splat(0.5));
            let apart = middle.distance(direction);
            assert!(apart < 0.95, "{direction}: texel {texel} is {apart} away, of {texels:?}");
            mean += f64::from(*weight) * middle;
        }
        let apart = mean.normalize().distance(direction);
        assert!(apart < 0.2, "{direction}: the taps' mean is {mean}, {apart} away");
        if ix >= n_random {
            // (At the map's border two of the four can be the same.)
            let is_own = |(texel, _): &(&f32, &f32)| **texel as usize == ix - n_random;
            let own: f32 =
                texels.iter().zip(weights).filter(is_own).map(|(_, weight)| weight).sum();
            assert!(own > 0.9999, "middle of {}: {taps:?}", ix - n_random);
        }
    }
}

/// The folded map is continuous: a step over an edge leads to a texel that touches it.
#[test]
fn texels_beyond_an_edge_touch_it() {
    let side = MAP_SIDE as i32;
    let inputs: Vec<[i32; 2]> =
        (-1..=side).flat_map(|y| (-1..=side).map(move |x| [x, y])).collect();
    let found: Vec<u32> = map(
        "#import lucerna::components::probes::octahedral_map::folded_texel
         alias Input = vec2<i32>;
         alias Output = u32;
         fn map(x: Input) -> Output { return folded_texel(x); }",
        &inputs,
    );
    for ([x, y], texel) in inputs.into_iter().zip(found) {
        let inside = [x.clamp(0, side - 1), y.clamp(0, side - 1)];
        if [x, y] == inside {
            assert_eq!(texel as i32, y * side + x, "inside");
            continue;
        }
        // The point of the edge (or corner) that was stepped over, seen from both texels.
        let over = |at: i32| match at {
            -1 => -1.0,
            at if at == side => 1.0,
            at => (f64::from(at) + 0.5) / f64::from(side) * 2.0 - 1.0,
        };
        let edge = direction_of(DVec2::new(over(x), over(y)));
        let corners = [0.0, 0.5, 1.0].map(|u| [0.0, 0.5, 1.0].map(|v| DVec2::new(u, v)));
        let nearest = corners
            .iter()
            .flatten()
            .map(|at| direction_of_texel(texel, *at).distance(edge))
            .fold(f64::MAX, f64::min);
        assert!(nearest < 1e-9, "({x}, {y}) folds to texel {texel}, {nearest} from the edge");
    }
}

/// Chebyshev's bound, the wrapped cosine and the stretched shares, by their formulas in f64.
#[test]
fn weights_are_those_of_their_formulas() {
    let mut random = Random(6);
    let inputs: Vec<[f32; 8]> = (0..2000)
        .map(|ix| {
            let mean = 2.0 * random.unit();
            let variance = if ix % 3 == 0 { 0.0 } else { 0.3 * random.unit() };
            let normal = random.direction();
            let to_probe = random.direction();
            [
                2.5 * random.unit(),
                mean,
                mean * mean + variance,
                random.unit(),
                0.05 + 0.5 * random.unit(),
                normal.dot(to_probe).clamp(-1.0, 1.0),
                1e-3,
                0.0,
            ]
        })
        .collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::probes::visibility::{seen_share, without_bleeding, wrapped_weight}
         struct Input { a: vec4<f32>, b: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let c = x.b.y;
             let tilted = vec3<f32>(sqrt(max(1.0 - c * c, 0.0)), 0.0, c);
             return vec4<f32>(
                 seen_share(x.a.x, x.a.yz, x.b.z),
                 without_bleeding(x.a.w, x.b.x),
                 wrapped_weight(vec3<f32>(0.0, 0.0, 1.0), tilted),
                 0.0,
             );
         }",
        &inputs,
    );
    let close = |what: &str, found: f32, expected: f64| {
        // (Mean and square are rounded to 2⁻²⁴ of 4; their difference may be as small as the least variance of 1e-3.)
        let limit = 1e-5 + 1e-3 * expected;
        assert!((f64::from(found) - expected).abs() < limit, "{what}: {found}, not {expected}");
    };
    for (input, found) in inputs.iter().zip(found) {
        let [distance, mean, square, weight, least, cosine, least_variance, _] =
            input.map(f64::from);
        let variance = (square - mean * mean).max(least_variance);
        let beyond = distance - mean;
        let seen = if beyond <= 0.0 { 1.0 } else { variance / (variance + beyond * beyond) };
        close("seen", found[0], seen);
        let stretched = if weight < least { 0.0 } else { (weight - least) / (1.0 - least) };
        close("without bleeding", found[1], stretched);
        close("wrapped", found[2], ((cosine + 1.0) / 2.0).powi(2) + 0.2);
    }
}

pub fn upload(scene: &Scene) -> GpuScene {
    let options = settings!(GpuSceneOptions { diffuse_only: true });
    GpuScene::new(gpu(), scene, options).unwrap()
}

pub fn world(meshes: Vec<Mesh>, materials: Vec<Material>) -> Scene {
    let instances = (0..meshes.len())
        .map(|mesh| Instance { mesh, world_from_object: glam::Affine3A::IDENTITY });
    Scene { instances: instances.collect(), meshes, materials, ..Scene::default() }
}

fn mesh(positions: Vec<Vec3>, indices: Vec<[u32; 3]>) -> Mesh {
    Mesh { positions, triangles: indices, ..Mesh::default() }
}

/// A box from `min` to `max`, whose faces look inwards.
pub fn room(min: Vec3, max: Vec3) -> Mesh {
    let corner = |ix: u32| {
        let bit = |k: u32| (ix >> k & 1) as f32;
        min + (max - min) * Vec3::new(bit(0), bit(1), bit(2))
    };
    let quads =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    // (Turned so that their normals look at the middle.)
    let triangles = quads.iter().flat_map(|[a, b, c, d]| {
        let middle = 0.5 * (corner(*a) + corner(*c));
        let normal = (corner(*b) - corner(*a)).cross(corner(*c) - corner(*a));
        let inwards = normal.dot(0.5 * (min + max) - middle) > 0.0;
        let (b, d) = if inwards { (*b, *d) } else { (*d, *b) };
        [[*a, b, *c], [*a, *c, d]]
    });
    mesh((0..8).map(corner).collect(), triangles.collect())
}

pub fn lambert(albedo: f32) -> Material {
    Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        roughness: 1.0,
        metallic: 0.0,
        ..Default::default()
    }
}

/// A probe as the lattice has it.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    pub corner: UVec3,
    /// From its corner [cells].
    pub moved: DVec3,
    pub is_inside: bool,
    /// [m]
    pub at: DVec3,
}

/// The probes, in the order of their slots.
pub fn placed(probes: &Probes) -> Vec<Placed> {
    let counts: VoxelCounts =
        bytemuck::pod_read_unaligned(&read(probes.occupancy().unwrap().counts()));
    let words: Vec<[u32; 2]> =
        bytemuck::pod_collect_to_vec(&read(probes.occupancy().unwrap().structure()));
    let lattice = probes.lattice().unwrap();
    let first = n_bricks(lattice) as usize;
    let of = |&[packed, place]: &[u32; 2]| {
        let corner = UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20);
        // Ten bits in two's complement.
        let steps = |shift: u32| f64::from(((place >> shift & 1023) as i32 ^ 512) - 512);
        let moved = DVec3::new(steps(0), steps(10), steps(20)) / 1024.0;
        let at = lattice.origin.as_dvec3() + (corner.as_dvec3() + moved) * f64::from(lattice.cell);
        Placed { corner, moved, is_inside: place >> 30 != 0, at }
    };
    words[first..first + counts.n_voxels as usize].iter().map(of).collect()
}

/// The corners that have probes, in the order of their slots.
fn corners_of(probes: &Probes) -> Vec<UVec3> {
    placed(probes).iter().map(|probe| probe.corner).collect()
}

/// Coefficients that were gathered: [`COEFFICIENTS`] for each probe.
pub fn gathered(probes: &Probes) -> Vec<[f32; 4]> {
    bytemuck::pod_collect_to_vec(&read(probes.gathered()))
}

/// Probes are at the corners of the cells that surfaces meet (as a voxelizer of its own finds them), at those of the middle cells (of two cells)
/// that are next to them or around them, and at every fourth corner and the last of each axis, each once, and nowhere else.
#[test]
fn probes_are_at_the_corners_of_cells_with_surfaces_and_of_wide_cells() {
    let mut random = Random(7);
    for (n_triangles, cells) in [(1, 2), (1, 9), (40, 17), (200, 32)] {
        let positions: Vec<Vec3> =
            (0..3 * n_triangles).map(|_| 3.0 * random.direction() * random.unit()).collect();
        let indices = (0..n_triangles).map(|ix| [3 * ix, 3 * ix + 1, 3 * ix + 2]).collect();
        let scene = upload(&world(vec![mesh(positions, indices)], vec![lambert(0.5)]));
        let chosen = settings!(ProbeSettings { cells, n_paths: 1 });
        let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
        submit(|recorder| probes.update(recorder, &scene)).unwrap();
        let facts = scene.facts();
        let grid = grid_for_bounds(
            facts.bounds_min,
            facts.bounds_max,
            Resolution::Longest(cells),
            1,
            None,
        )
        .unwrap();
        let voxelizer = Voxelizer::new(gpu(), &scene, grid).unwrap();
        submit(|recorder| voxelizer.record(recorder, &scene, Triangles::All)).unwrap();
        let counts: VoxelCounts = bytemuck::pod_read_unaligned(&read(voxelizer.counts()));
        let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(voxelizer.structure()));
        let first = n_bricks(&grid) as usize;
        let mut expected = HashSet::new();
        for [packed, _] in &words[first..first + counts.n_voxels as usize] {
            let cell = IVec3::new(
                (packed & 1023) as i32,
                (packed >> 10 & 1023) as i32,
                (packed >> 20) as i32,
            );
            for ix in 0..8 {
                expected.insert((cell + IVec3::new(ix & 1, ix >> 1 & 1, ix >> 2)).as_uvec3());
            }
            // Middle cells within one of its own: their corners are even, or the last.
            let last = probes.lattice().unwrap().size.as_ivec3() - 1;
            let near = |k: usize| {
                let own = cell[k] / 2;
                (0..=last[k]).filter(move |at| {
                    let ix = if *at == last[k] { (last[k] + 1) / 2 } else { at / 2 };
                    (at % 2 == 0 || *at == last[k]) && (own - 1..=own + 2).contains(&ix)
                })
            };
            for z in near(2) {
                for y in near(1) {
                    expected.extend(near(0).map(|x| IVec3::new(x, y, z).as_uvec3()));
                }
            }
        }
        let size = probes.lattice().unwrap().size;
        let along = |n: u32| (0..n).filter(move |ix| ix % 4 == 0 || *ix == n - 1);
        for z in along(size.z) {
            for y in along(size.y) {
                expected.extend(along(size.x).map(|x| UVec3::new(x, y, z)));
            }
        }
        let found = corners_of(&probes);
        let unique: HashSet<UVec3> = found.iter().copied().collect();
        assert_eq!(found.len(), unique.len(), "probes at the same corner");
        assert_eq!(unique, expected, "{n_triangles} triangles, {cells} cells: corners with probes");
        let counts: VoxelCounts =
            bytemuck::pod_read_unaligned(&read(probes.occupancy().unwrap().counts()));
        assert_eq!(counts.n_overflow, 0, "probes without room");
    }
}

/// A half in 16 bits as f64.
fn half(bits: u32) -> f64 {
    half::f16::from_bits(bits as u16).to_f64()
}

/// In a room, the map of a probe inside holds the mean distance to the walls and the mean of its square over 4 × 4 directions of each
/// texel, by f64, up to 2.5 cells, at corners of middle cells 4, of wide cells 7.5. Tolerance: halfs (2⁻¹¹) and the rays' own, 1e-4 cells. Probes inside count, those
/// behind a wall see its back and hardly do, unless it has two sides. (Behind an edge, a probe sees little of two walls.)
#[test]
fn maps_hold_the_distances_to_the_walls() {
    let (min, max) = (DVec3::new(-1.3, 0.2, -0.7), DVec3::new(1.1, 1.9, 1.6));
    for (double_sided, moves) in [(false, true), (false, false), (true, true), (true, false)] {
        let material = Material { double_sided, ..lambert(0.5) };
        let scene = upload(&world(vec![room(min.as_vec3(), max.as_vec3())], vec![material]));
        let chosen = settings!(ProbeSettings { cells: 9, n_paths: 1, moves });
        let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
        submit(|recorder| probes.update(recorder, &scene)).unwrap();
        let cell = f64::from(probes.lattice().unwrap().cell);
        let texels: Vec<u32> = bytemuck::pod_collect_to_vec(&read(probes.distances()));
        let mut n_inside = 0;
        for (probe, placed) in placed(&probes).into_iter().enumerate() {
            let at = placed.at;
            let is_inside = at.cmpgt(min).all() && at.cmplt(max).all();
            let n_beyond = (0..3).filter(|&k| at[k] < min[k] || at[k] > max[k]).count();
            // (Rays end after 2.5 cells: one that is farther away sees nothing.)
            let near = (at.clamp(min, max).distance(at) / cell) < 2.0;
            if (n_beyond < 2 && near) || double_sided {
                let expected = !(is_inside || double_sided);
                assert_eq!(placed.is_inside, expected, "{placed:?}, double-sided {double_sided}");
            }
            if !is_inside {
                continue;
            }
            n_inside += 1;
            let last = probes.lattice().unwrap().size - 1;
            let is_of = |stride: u32| {
                (0..3).all(|k| placed.corner[k] % stride == 0 || placed.corner[k] == last[k])
            };
            let most = if is_of(4) {
                7.5
            } else if is_of(2) {
                4.0
            } else {
                2.5
            };
            for texel in 0..MAP_SIDE * MAP_SIDE {
                let mut mean = DVec2::ZERO;
                for ix in 0..16 {
                    let inside = (DVec2::new((ix % 4).into(), (ix / 4).into()) + 0.5) / 4.0;
                    let d = direction_of_texel(texel, inside);
                    let away = (0..3).map(|k| {
                        let wall = if d[k] > 0.0 { max[k] } else { min[k] };
                        if d[k] == 0.0 { f64::MAX } else { (wall - at[k]) / d[k] }
                    });
                    let distance = (away.fold(f64::MAX, f64::min) / cell).min(most);
                    mean += DVec2::new(distance, distance * distance) / 16.0;
                }
                let word = texels[probe * (MAP_SIDE * MAP_SIDE) as usize + texel as usize];
                for (found, expected) in [(half(word), mean.x), (half(word >> 16), mean.y)] {
                    let limit = 6e-4 * expected + 1e-4;
                    assert!(
                        (found - expected).abs() <= limit,
                        "{placed:?}, texel {texel}: {found}, expected {expected} within {limit}"
                    );
                }
            }
        }
        assert!(n_inside > 50, "probes inside: {n_inside}");
    }
}

/// Over a wide floor of albedo ρ in the light E of a lamp far above, a probe finds ρE/π from below and nothing from above: cⱼ is the
/// integral of Yⱼ over the lower hemisphere times that, by the closed forms of a half space. The floor's edge is 50 times as far as
/// these probes are high. Tolerance: 4π·Y·L over half of the sphere has a deviation of 2.5 L, which 2048
/// independent paths bring to 0.055 L; a Sobol sequence has less than half of that. And 2 % for what is beyond the floor's edge.
#[test]
fn probes_find_the_light_of_a_floor() {
    let (albedo, irradiance) = (0.7, 3.0);
    let half = 60.0;
    let floor = mesh(
        [[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]]
            .map(Vec3::from_array)
            .into(),
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let mut scene = world(vec![floor], vec![lambert(albedo as f32)]);
    scene.lights.push(Light::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::splat(irradiance as f32),
    });
    scene.sky = Sky::Constant(Vec3::ZERO);
    let gpu_scene = upload(&scene);
    let chosen = settings!(ProbeSettings { cells: 96, n_paths: 2048, n_bounces: 2 });
    let mut probes = Probes::new(gpu(), &gpu_scene, chosen).unwrap();
    for _ in 0..32 {
        submit(|recorder| probes.update(recorder, &gpu_scene)).unwrap();
    }
    let light = gathered(&probes);
    let radiance = albedo * irradiance / PI;
    // Of order 2, integrated over y < 0: Y₀ = √(1/4π), Y₁₋₁ = √(3/4π) y, and those of band 2 that are even in x and z:
    // Y₂₀ = √(5/16π)(3z² − 1) and Y₂₂ = √(15/16π)(x² − z'…), which integrate to 0 over a half space.
    let mut expected = [0.0; 9];
    expected[0] = (1.0 / (4.0 * PI)).sqrt() * 2.0 * PI * radiance;
    expected[1] = -(3.0 / (4.0 * PI)).sqrt() * PI * radiance;
    let mut n_judged = 0;
    for (probe, placed) in placed(&probes).into_iter().enumerate() {
        let at = placed.at;
        if at.x.abs().max(at.z.abs()) > 9.0 || !(0.1..1.0).contains(&at.y) {
            continue;
        }
        n_judged += 1;
        for (k, expected) in expected.iter().enumerate() {
            let found = f64::from(light[probe * COEFFICIENTS as usize + k][1]);
            let limit = 0.055 * radiance + 0.02 * expected.abs();
            assert!(
                (found - expected).abs() < limit,
                "probe at {at}, coefficient {k}: {found}, expected {expected} within {limit}"
            );
        }
    }
    assert!(n_judged > 30, "probes over the floor: {n_judged}");
    let [rejected, cut]: [u32; 2] = bytemuck::pod_read_unaligned(&read_faults(&probes));
    assert_eq!([rejected, cut], [0, 0], "paths that were left out");
}

/// The two counters of faults, as the stats name them.
fn read_faults(probes: &Probes) -> Vec<u8> {
    let stats = probes.stats();
    let counts = stats.iter().filter(|stat| stat.unit == "paths");
    counts
        .flat_map(|stat| {
            let n = lucerna::blocking::read_stat(gpu(), stat).unwrap() as u32;
            n.to_le_bytes()
        })
        .collect()
}

/// The same scene and settings give the same bytes; another seed gives others, but the same probes.
#[test]
fn the_same_scene_gives_the_same_probes() {
    let mut scene = world(vec![room(Vec3::ZERO, Vec3::new(2.0, 1.0, 3.0))], vec![lambert(0.6)]);
    scene.lights.push(Light::Point {
        position: Vec3::new(0.7, 0.6, 1.1),
        intensity: Vec3::ONE,
        range: None,
    });
    let scene = upload(&scene);
    let run = |seed| {
        let chosen = settings!(ProbeSettings {
            cells: 8,
            seed,
            visibility: ProbeVisibility::None,
            ..Default::default()
        });
        let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
        for _ in 0..3 {
            submit(|recorder| probes.update(recorder, &scene)).unwrap();
        }
        let places = read(probes.occupancy().unwrap().structure());
        (read(probes.gathered()), read(probes.distances()), places, read(probes.light()))
    };
    let [first, second, other] = [run(1), run(1), run(2)];
    assert!(first == second, "two runs differ");
    assert!(first.0 != other.0, "two seeds give the same light");
    assert!(first.1 == other.1 && first.2 == other.2, "two seeds give other probes");
    let light: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&first.0);
    assert!(first.3 != other.3, "two seeds give the same packed light");
    assert_each("coefficients", &light, "finite", |c| c.iter().all(|x| x.is_finite()));
}

/// With `refine`, probes are first at the corners of the middle cells that have surfaces (and of wide cells); after 512 paths, cells where the second differences
/// of what those probes know are above eight times that share of their light, and three standard deviations of what batches of paths differ by, have their own corners, and the middle cells around them: as
/// found in f64 from what was gathered. Cells within 1 % of the limit may be either way.
#[test]
fn cells_are_divided_where_light_is_not_straight() {
    let floor = mesh(
        [[-4.0, 0.0, -4.0], [-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0]]
            .map(Vec3::from_array)
            .into(),
        vec![[0, 1, 2], [0, 2, 3]],
    );
    let wall = mesh(
        [[-3.0, 0.0, -3.0], [3.0, 0.0, -3.0], [0.0, 3.0, -2.0]].map(Vec3::from_array).into(),
        vec![[0, 1, 2]],
    );
    let mut scene = world(vec![floor, wall], vec![lambert(0.7), lambert(0.4)]);
    scene.lights.push(Light::Point {
        position: Vec3::new(1.5, 0.6, 1.0),
        intensity: Vec3::ONE,
        range: None,
    });
    let scene = upload(&scene);
    let facts = scene.facts();
    let cells = 40;
    let most = 0.1;
    let chosen = settings!(ProbeSettings { cells, n_paths: 320, refine: most });
    let mut probes = Probes::new(gpu(), &scene, chosen).unwrap();
    for _ in 0..8 {
        submit(|recorder| probes.update(recorder, &scene)).unwrap();
        assert_eq!(probes.n_paths(), 0, "paths while cells are not divided");
    }
    let before = placed(&probes);
    let light = gathered(&probes);
    let known: std::collections::HashMap<UVec3, (f64, f64)> = before
        .iter()
        .enumerate()
        .filter(|(_, probe)| !probe.is_inside)
        .map(|(slot, probe)| {
            let own = &light[slot * COEFFICIENTS as usize..];
            let [r, g, b, n] = own[0].map(f64::from);
            // Eight batches: the sum of squared differences from their mean.
            assert_eq!(n, 512.0, "paths that were followed");
            let variance = f64::from(own[2][3]) / (7.0 * 8.0);
            (probe.corner, ((0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0), variance))
        })
        .collect();
    submit(|recorder| probes.update(recorder, &scene)).unwrap();
    assert_eq!(probes.n_paths(), 64, "paths once cells are divided");

    let grid =
        grid_for_bounds(facts.bounds_min, facts.bounds_max, Resolution::Longest(cells), 1, None)
            .unwrap();
    let voxelizer = Voxelizer::new(gpu(), &scene, grid).unwrap();
    submit(|recorder| voxelizer.record(recorder, &scene, Triangles::All)).unwrap();
    let counts: VoxelCounts = bytemuck::pod_read_unaligned(&read(voxelizer.counts()));
    let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(voxelizer.structure()));
    let last = probes.lattice().unwrap().size.as_ivec3() - 1;
    let n_middle = (last + 1) / 2 + 1;
    let corner_of = |middle: IVec3| (middle * 2).min(last).as_uvec3();
    let is_within = |middle: IVec3| middle.cmpge(IVec3::ZERO).all() && middle.cmplt(n_middle).all();
    let light_at = |middle: IVec3| {
        if is_within(middle) { known.get(&corner_of(middle)).copied() } else { None }
    };
    // By how much a straight line is off in a middle cell, as a share of the limit.
    let off = |middle: IVec3| {
        let mut worst = 0.0f64;
        for ix in 0..8 {
            let at = middle + IVec3::new(ix & 1, ix >> 1 & 1, ix >> 2);
            let Some((own, noise)) = light_at(at) else { continue };
            for axis in IVec3::AXES {
                if let (Some((a, noise_a)), Some((b, noise_b))) =
                    (light_at(at - axis), light_at(at + axis))
                {
                    let scale = own.max(0.02 * own.max(a).max(b)).max(1e-300);
                    let difference = (a - 2.0 * own + b).abs();
                    let deviation = (noise_a + 4.0 * noise + noise_b).sqrt().max(1e-300);
                    // (As a share of the limit: both must be above theirs.)
                    let share = difference / 8.0 / scale / f64::from(most);
                    worst = worst.max(share.min(difference / (3.0 * deviation)));
                }
            }
        }
        worst
    };
    let (mut sure, mut possible) = (HashSet::new(), HashSet::new());
    let (mut n_divided, mut n_whole) = (0, 0);
    let first = n_bricks(&grid) as usize;
    for [packed, _] in &words[first..first + counts.n_voxels as usize] {
        let cell = UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20).as_ivec3();
        let worst = off(cell / 2);
        let (is_divided, may_be) = (worst > 1.01, worst > 0.99);
        n_divided += usize::from(is_divided);
        n_whole += usize::from(!may_be);
        let around = |reach: i32| {
            (0..64)
                .map(|ix| IVec3::new(ix & 3, ix >> 2 & 3, ix >> 4) - 1)
                .filter(move |step| {
                    (step.cmpge(IVec3::splat(-reach)) & step.cmple(IVec3::splat(1 + reach))).all()
                })
                .map(move |step| cell / 2 + step)
        };
        let own = (0..8).map(|ix| (cell + IVec3::new(ix & 1, ix >> 1 & 1, ix >> 2)).as_uvec3());
        for (set, divided) in [(&mut sure, is_divided), (&mut possible, may_be)] {
            set.extend(around(i32::from(divided)).filter(|at| is_within(*at)).map(corner_of));
            if divided {
                set.extend(own.clone());
            }
        }
    }
    let size = probes.lattice().unwrap().size;
    let along = |n: u32| (0..n).filter(move |ix| ix % 4 == 0 || *ix == n - 1);
    for z in along(size.z) {
        for y in along(size.y) {
            for set in [&mut sure, &mut possible] {
                set.extend(along(size.x).map(|x| UVec3::new(x, y, z)));
            }
        }
    }
    let found: HashSet<UVec3> = corners_of(&probes).into_iter().collect();
    assert!(sure.is_subset(&found), "{:?} are missing", sure.difference(&found).next());
    assert!(found.is_subset(&possible), "{:?} are too many", found.difference(&possible).next());
    assert!(n_divided > 20 && n_whole > 500, "{n_divided} cells are divided, {n_whole} are not");
}
