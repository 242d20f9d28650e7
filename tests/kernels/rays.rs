// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene seam's rays: both implementations against a brute-force oracle and each other.

use crate::harness::{Random, assert_each, gpu, ray_query_gpu, read, storage, submit};
use crate::texture_oracle;
use glam::{Affine2, Affine3A, DVec3, Vec2, Vec3, Vec4};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use lucerna::scene::{
    AlphaMode, Filter, Image, Instance, Material, Mesh, Scene, Texture, TextureRef, Wrap,
};
use lucerna::settings;

/// A scene of loose triangles.
pub fn soup(triangles: &[[Vec3; 3]]) -> Scene {
    Scene {
        meshes: vec![Mesh {
            positions: triangles.iter().flatten().copied().collect(),
            triangles: (0..triangles.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(),
            ..Mesh::default()
        }],
        instances: vec![Instance { mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    }
}

pub fn random_triangles(n: usize, size: f32, seed: u64) -> Vec<[Vec3; 3]> {
    let mut random = Random(seed);
    (0..n)
        .map(|_| {
            let center = Vec3::from_array(std::array::from_fn(|_| random.range(-10.0, 10.0)));
            std::array::from_fn(|_| center + size * random.range(0.05, 1.0) * random.direction())
        })
        .collect()
}

pub fn random_rays(n: usize, seed: u64) -> Vec<Ray> {
    let mut random = Random(seed);
    (0..n)
        .map(|k| {
            let origin = Vec3::from_array(std::array::from_fn(|_| random.range(-12.0, 12.0)));
            let mut direction = random.direction();
            // Some along the axes, where inverse directions are infinite.
            if k % 50 == 0 {
                direction = Vec3::AXES[k / 50 % 3] * if k % 100 == 0 { 1.0 } else { -1.0 };
            }
            let t_max = match k % 3 {
                0 => random.range(1.0, 10.0),
                1 => f32::MAX,
                _ => f32::INFINITY,
            };
            Ray { origin, t_min: 0.0, direction, t_max }
        })
        .collect()
}

fn on_gpu(scene: &Scene, rays: RaySource) -> GpuScene {
    GpuScene::new(gpu(), scene, settings!(GpuSceneOptions { rays, ..Default::default() })).unwrap()
}

/// Answers behind the last ray's.
const N_GUARDS: usize = 70;

pub fn trace(scene: &GpuScene, question: RayQuestion, rays: &[Ray]) -> Vec<u8> {
    let gpu = gpu();
    let kernel = RayKernel::new(gpu, scene, question);
    let ray_buffer = storage(bytemuck::cast_slice(rays));
    let bytes = match question {
        RayQuestion::Nearest => size_of::<Hit>(),
        RayQuestion::Any => 4,
    };
    // More room than a workgroup fills: no answer may stand behind the last ray's.
    let answers = storage(&vec![0xcd; (rays.len() + N_GUARDS) * bytes]);
    let n = rays.len() as u32;
    submit(|recorder| kernel.record(recorder, scene, &ray_buffer, &answers, n)).unwrap();
    let found = read(&answers);
    let (answers, behind) = found.split_at(rays.len() * bytes);
    let what = format!("bytes behind the answers of {n} rays, {question:?}");
    assert_each(&what, behind, "as they were", |&byte| byte == 0xcd);
    answers.to_vec()
}

pub fn nearest(scene: &GpuScene, rays: &[Ray]) -> Vec<Hit> {
    bytemuck::pod_collect_to_vec(&trace(scene, RayQuestion::Nearest, rays))
}

pub fn any(scene: &GpuScene, rays: &[Ray]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&trace(scene, RayQuestion::Any, rays))
}

/// What f64 says about a ray and a triangle.
struct Crossing {
    t: f64,
    /// Weights of the second and third corner.
    weights: [f64; 2],
    /// Whether it counts.
    inside: bool,
    /// Whether f32 may decide either way: near an edge, in barycentric terms, or near the ray's ends.
    doubtful: bool,
}

/// Möller–Trumbore in f64; none for a ray that runs along the triangle.
fn crossing(corners: &[Vec3; 3], ray: &Ray) -> Option<Crossing> {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let (edge_b, edge_c) = (b - a, c - a);
    let p = direction.cross(edge_c);
    let determinant = edge_b.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let s: DVec3 = origin - a;
    let u = s.dot(p) / determinant;
    let q = s.cross(edge_b);
    let v = direction.dot(q) / determinant;
    let t = edge_c.dot(q) / determinant;
    let margin = u.min(v).min(1.0 - u - v);
    let end = (t - f64::from(ray.t_max)).abs() < 1e-4 || (t - f64::from(ray.t_min)).abs() < 1e-4;
    Some(Crossing {
        t,
        weights: [u, v],
        inside: margin >= 0.0 && t > f64::from(ray.t_min) && t < f64::from(ray.t_max),
        doubtful: margin.abs() < 1e-4 || (margin > -1e-4 && end),
    })
}

/// The nearest hit's distance, and whether f32 may find another one.
fn oracle(triangles: &[[Vec3; 3]], ray: &Ray) -> (Option<f64>, bool) {
    let mut nearest = None;
    let mut doubtful = false;
    for found in triangles.iter().filter_map(|corners| crossing(corners, ray)) {
        doubtful |= found.doubtful;
        if found.inside && nearest.is_none_or(|t| found.t < t) {
            nearest = Some(found.t);
        }
    }
    (nearest, doubtful)
}

/// 1000 triangles, 20 000 rays. Distances: relative 1e-5, from f32 coordinates of size 12 (one
/// rounding is 6e-7 m) at distances from 1e-1 up; triangles seen edge-on are among the doubtful.
fn agrees_with_brute_force(source: RaySource) {
    let triangles = random_triangles(1000, 3.0, 7);
    let scene = on_gpu(&soup(&triangles), source);
    let rays = random_rays(20_000, 8);
    let hits = nearest(&scene, &rays);
    let blocked = any(&scene, &rays);
    let (mut n_hits, mut n_doubtful) = (0, 0);
    for ((ray, hit), &blocked) in rays.iter().zip(&hits).zip(&blocked) {
        let (expected, doubtful) = oracle(&triangles, ray);
        if doubtful {
            n_doubtful += 1;
            continue;
        }
        assert_eq!(blocked == 1, expected.is_some(), "whether any_hit of {ray:?} finds one");
        assert_eq!(
            hit.triangle != NONE,
            expected.is_some(),
            "whether nearest_hit of {ray:?} finds one: {hit:?}"
        );
        if let Some(t) = expected {
            n_hits += 1;
            let error = (f64::from(hit.t) - t).abs();
            assert!(
                error < 2e-5 + 1e-5 * t,
                "{ray:?}: the nearest hit is {hit:?}, expected t = {t} within {:.1e}",
                2e-5 + 1e-5 * t
            );
        }
    }
    println!("{n_hits} hits of {} rays, {n_doubtful} too close to an edge", rays.len());
    assert!(
        n_hits > 5000 && n_doubtful < 1000,
        "{n_hits} hits and {n_doubtful} doubtful rays, expected above 5000 and below 1000"
    );
}

#[test]
fn software_rays_agree_with_brute_force() {
    agrees_with_brute_force(RaySource::Software);
}

#[test]
fn ray_query_agrees_with_brute_force() {
    if ray_query_gpu().is_some() {
        agrees_with_brute_force(RaySource::RayQuery);
    }
}

/// 24 000 triangles, 10⁶ rays. Both answer in f32 by different formulas, so they may differ where
/// a ray passes an edge within rounding: coordinates of size 12 against triangles of 0.3 m make
/// that a strip of about 1e-6/0.3 of each triangle, far below the 1e-4 that is allowed.
#[test]
fn ray_query_agrees_with_software_on_a_million_rays() {
    if ray_query_gpu().is_none() {
        return;
    }
    let scene = soup(&random_triangles(24_000, 0.6, 17));
    let (software, hardware) =
        (on_gpu(&scene, RaySource::Software), on_gpu(&scene, RaySource::RayQuery));
    let rays = random_rays(1_000_000, 18);
    let same = |a: &Hit, b: &Hit| {
        (a.triangle == NONE) == (b.triangle == NONE)
            && (a.triangle == NONE || (a.t - b.t).abs() <= 1e-4 * a.t)
    };
    let (ours, theirs) = (nearest(&software, &rays), nearest(&hardware, &rays));
    let hits = ours.iter().filter(|hit| hit.triangle != NONE).count();
    let nearest_differ = ours.iter().zip(&theirs).filter(|(a, b)| !same(a, b)).count();
    let any_differ =
        any(&software, &rays).iter().zip(&any(&hardware, &rays)).filter(|(a, b)| a != b).count();
    println!("{hits} hits; nearest hits differ: {nearest_differ}, any hits: {any_differ}");
    assert!(hits > 100_000, "{hits} of {} rays hit, expected above 100 000", rays.len());
    assert!(
        nearest_differ <= 100 && any_differ <= 100,
        "by ray query and by software {nearest_differ} nearest and {any_differ} any hits differ, expected at most 100 of each"
    );
}

/// Triangles with and without masks, one mesh a material.
fn masked_soup() -> Scene {
    let mut random = Random(27);
    let images = (0..2)
        .map(|k| Image {
            name: format!("mask {k}"),
            width: 8,
            height: 4,
            // About two thirds are cut away, so that many layers are passed.
            rgba: (0..32)
                .map(|_| [255, 255, 255, if random.unit() < 0.65 { 0 } else { 255 }])
                .collect(),
        })
        .collect();
    let filters = [Filter::Nearest, Filter::Linear];
    let textures = filters
        .iter()
        .enumerate()
        .map(|(image, &filter)| Texture {
            image,
            wrap_u: Wrap::Repeat,
            wrap_v: Wrap::Mirror,
            filter,
        })
        .collect();
    let mask = |texture, alpha, cutoff| Material {
        base_color: Vec4::new(1.0, 1.0, 1.0, alpha),
        base_color_texture: Some(TextureRef {
            texture,
            uv_set: 0,
            uv_from_mesh: Affine2::from_scale(Vec2::new(1.5, 0.75)),
        }),
        alpha: AlphaMode::Mask { cutoff },
        ..Material::default()
    };
    // The third is cut away everywhere: its factor is below the cutoff.
    let materials =
        vec![mask(0, 1.0, 0.5), mask(1, 0.9, 0.4), mask(0, 0.3, 0.5), Material::default()];
    let mut scene = Scene { materials, textures, images, ..Scene::default() };
    for (material, n) in [150, 150, 100, 10].into_iter().enumerate() {
        let triangles = random_triangles(n, 8.0, 30 + material as u64);
        let mut mesh = soup(&triangles).meshes.remove(0);
        mesh.uv0 = mesh
            .positions
            .iter()
            .map(|_| Vec2::new(random.range(-2.0, 3.0), random.range(-2.0, 3.0)))
            .collect();
        mesh.material = material;
        scene.meshes.push(mesh);
        scene.instances.push(Instance { mesh: material, world_from_object: Affine3A::IDENTITY });
    }
    scene
}

/// The nearest triangle that is there, layers that are cut away before it, and doubt.
fn masked_oracle(scene: &Scene, ray: &Ray) -> (Option<f64>, usize, bool) {
    let mut layers = Vec::new();
    let mut doubtful = false;
    for mesh in &scene.meshes {
        let material = &scene.materials[mesh.material];
        for corners in &mesh.triangles {
            let corners = corners.map(|ix| ix as usize);
            let Some(found) = crossing(&corners.map(|ix| mesh.positions[ix]), ray) else {
                continue;
            };
            doubtful |= found.doubtful;
            if !found.inside {
                continue;
            }
            let mut solid = true;
            if let (Some(texture), AlphaMode::Mask { cutoff }) =
                (&material.base_color_texture, material.alpha)
            {
                let [u, v] = found.weights.map(|w| w as f32);
                let [a, b, c] = corners.map(|ix| mesh.uv0[ix]);
                let uv = a * (1.0 - u - v) + b * u + c * v;
                let texel = texture_oracle::sample(scene, texture, uv, true);
                let alpha = f64::from(material.base_color.w) * texel.value.w;
                solid = alpha >= f64::from(cutoff);
                // Barycentrics are good to 1e-5 here, times 5 repeats of 8 texels.
                let is_nearest = scene.textures[texture.texture].filter == Filter::Nearest;
                doubtful |= is_nearest && texel.to_edge < 2e-3;
                doubtful |= !is_nearest && (alpha - f64::from(cutoff)).abs() < 2e-3;
            }
            layers.push((found.t, solid));
        }
    }
    layers.sort_by(|a, b| a.0.total_cmp(&b.0));
    let first = layers.iter().position(|&(_, solid)| solid);
    (first.map(|ix| layers[ix].0), first.unwrap_or(layers.len()), doubtful)
}

/// Masks of both filters, mirrored, scaled, with a factor, and one that removes everything; rays
/// through up to a dozen layers that are cut away. Tolerance of distances as with brute force.
fn masks_agree_with_brute_force(source: RaySource) {
    let scene = masked_soup();
    let on_gpu = on_gpu(&scene, source);
    let rays = random_rays(20_000, 28);
    let (hits, blocked) = (nearest(&on_gpu, &rays), any(&on_gpu, &rays));
    let (mut n_hits, mut n_misses, mut n_doubtful, mut most_layers) = (0, 0, 0, 0);
    for ((ray, hit), &blocked) in rays.iter().zip(&hits).zip(&blocked) {
        let (expected, layers, doubtful) = masked_oracle(&scene, ray);
        if doubtful {
            n_doubtful += 1;
            continue;
        }
        most_layers = most_layers.max(layers);
        assert_eq!(
            hit.triangle != NONE,
            expected.is_some(),
            "whether nearest_hit of {ray:?} finds one: {hit:?}"
        );
        assert_eq!(blocked == 1, expected.is_some(), "whether any_hit of {ray:?} finds one");
        if let Some(t) = expected {
            n_hits += 1;
            let error = (f64::from(hit.t) - t).abs();
            assert!(
                error < 2e-5 + 1e-5 * t,
                "{ray:?}: the nearest hit is {hit:?}, expected t = {t} within {:.1e}",
                2e-5 + 1e-5 * t
            );
        } else {
            n_misses += usize::from(layers > 0);
        }
    }
    println!(
        "{n_hits} hits, {n_misses} rays through cut-away layers only, {n_doubtful} doubtful, {most_layers} layers at most"
    );
    assert!(
        n_hits > 5000 && n_misses > 1000 && n_doubtful < 4000 && most_layers >= 8,
        "{n_hits} hits, {n_misses} misses through layers, {n_doubtful} doubtful rays and at most {most_layers} layers, expected above 5000, above 1000, below 4000 and at least 8"
    );
}

#[test]
fn software_rays_pass_masks_as_brute_force_does() {
    masks_agree_with_brute_force(RaySource::Software);
}

#[test]
fn ray_query_passes_masks_as_brute_force_does() {
    if ray_query_gpu().is_some() {
        masks_agree_with_brute_force(RaySource::RayQuery);
    }
}

#[test]
fn ray_query_and_software_agree_on_masks() {
    if ray_query_gpu().is_none() {
        return;
    }
    let scene = masked_soup();
    let (software, hardware) =
        (on_gpu(&scene, RaySource::Software), on_gpu(&scene, RaySource::RayQuery));
    let rays = random_rays(200_000, 29);
    let (ours, theirs) = (nearest(&software, &rays), nearest(&hardware, &rays));
    let differ = ours
        .iter()
        .zip(&theirs)
        .filter(|(a, b)| {
            (a.t - b.t).abs() > 1e-4 * a.t || (a.triangle == NONE) != (b.triangle == NONE)
        })
        .filter(|(a, b)| a.triangle != NONE || b.triangle != NONE)
        .count();
    let any_differ =
        any(&software, &rays).iter().zip(&any(&hardware, &rays)).filter(|(a, b)| a != b).count();
    println!("nearest hits differ: {differ}, any hits: {any_differ}");
    // The masks' edges are where rounding decides, too: 1e-5 of a barycentric range a texel edge.
    assert!(
        differ <= 100 && any_differ <= 100,
        "by ray query and by software {differ} nearest and {any_differ} any hits differ on masks, expected at most 100 of each"
    );
}

/// A triangle that fills x, y ∈ [−1, 1] (and more) at this z, whose front looks towards −Z or +Z.
fn wall(z: f32) -> [Vec3; 3] {
    [Vec3::new(-1.0, -1.0, z), Vec3::new(3.0, -1.0, z), Vec3::new(-1.0, 3.0, z)]
}

fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
    Ray { origin: origin.into(), t_min: 0.0, direction: direction.into(), t_max: f32::MAX }
}

/// 0 to 4 triangles: trees of a single node, with empty slots.
fn small_scenes(source: RaySource) {
    for n in 0..=4usize {
        let triangles: Vec<_> = (0..n).map(|k| wall(1.0 + k as f32)).collect();
        let scene = on_gpu(&soup(&triangles), source);
        assert_eq!(scene.n_triangles() as usize, n, "triangles of the scene");
        let rays: Vec<_> =
            (0..=n).map(|k| ray([0.0, 0.0, 0.5 + k as f32], [0.0, 0.0, 1.0])).collect();
        let (hits, blocked) = (nearest(&scene, &rays), any(&scene, &rays));
        for (k, (hit, &blocked)) in hits.iter().zip(&blocked).enumerate() {
            let is_hit = k < n;
            assert_eq!(
                hit.triangle != NONE,
                is_hit,
                "{n} triangles: whether ray {k} has a nearest hit: {hit:?}"
            );
            assert_eq!(blocked == 1, is_hit, "{n} triangles: whether ray {k} has any hit");
            // All coordinates are exact in f32, and so is the quotient.
            assert!(
                !is_hit || hit.t == 0.5,
                "{n} triangles: the nearest hit of ray {k} is {hit:?}, expected t = 0.5"
            );
        }
        let away = random_rays(100, 9).into_iter().map(|r| Ray { direction: Vec3::NEG_Z, ..r });
        let away: Vec<_> = away.map(|r| Ray { origin: r.origin.with_z(0.5), ..r }).collect();
        assert_each(
            &format!("{n} triangles: nearest hits of rays away from them"),
            &nearest(&scene, &away),
            "none",
            |hit| hit.triangle == NONE,
        );
        assert_each(
            &format!("{n} triangles: any hits of rays away from them"),
            &any(&scene, &away),
            "0",
            |&blocked| blocked == 0,
        );
    }
}

#[test]
fn software_rays_in_scenes_of_few_triangles() {
    small_scenes(RaySource::Software);
}

#[test]
fn ray_query_in_scenes_of_few_triangles() {
    if ray_query_gpu().is_some() {
        small_scenes(RaySource::RayQuery);
    }
}

/// Coplanar duplicates, limits of t, axis-parallel rays within planes, origins on surfaces,
/// triangles without area, far-away coordinates. Every number here is exact in f32.
fn degenerate_input(source: RaySource) {
    let flat = |z: f32| [Vec3::new(0.0, 0.0, z), Vec3::new(1.0, 0.0, z), Vec3::new(2.0, 0.0, z)];
    let point = [Vec3::splat(0.25); 3];
    let triangles =
        vec![wall(4.0), wall(4.0), wall(8.0), flat(2.0), point, [Vec3::splat(f32::NAN); 3]];
    let scene = on_gpu(&soup(&triangles), source);
    assert_eq!(
        (scene.n_triangles(), scene.skipped_triangles()),
        (3, 3),
        "triangles kept and skipped"
    );
    let along = ray([0.25, 0.25, 0.0], [0.0, 0.0, 1.0]);
    let back = ray([0.25, 0.25, 16.0], [0.0, 0.0, -1.0]);
    let up = f32::next_up;
    let cases = [
        ("duplicates", along, Some(4.0)),
        ("t counts in the direction's length", ray([0.25, 0.25, 0.0], [0.0, 0.0, 0.5]), Some(8.0)),
        ("tiny direction", ray([0.25, 0.25, 0.0], [0.0, 0.0, 1e-15]), Some(4.0 / 1e-15)),
        ("from behind", back, Some(8.0)),
        ("the end is open", Ray { t_max: 4.0, ..along }, None),
        ("just beyond", Ray { t_max: up(4.0), ..along }, Some(4.0)),
        ("the start is open", Ray { t_min: 4.0, ..along }, Some(8.0)),
        ("empty interval", Ray { t_min: 5.0, t_max: 4.5, ..along }, None),
        ("infinite end", Ray { t_max: f32::INFINITY, ..along }, Some(4.0)),
        (
            "infinite end, miss",
            Ray { t_max: f32::INFINITY, ..ray([0.0, 0.0, 9.0], [0.0, 0.0, 1.0]) },
            None,
        ),
        ("on a surface", ray([0.25, 0.25, 4.0], [0.0, 0.0, 1.0]), Some(4.0)),
        ("on a surface, downwards", ray([0.25, 0.25, 4.0], [0.0, 0.0, -1.0]), None),
        ("on the last surface", ray([0.25, 0.25, 8.0], [0.0, 0.0, 1.0]), None),
        ("within a plane", ray([-5.0, 0.25, 4.0], [1.0, 0.0, 0.0]), None),
        ("along an edge", ray([-5.0, -1.0, 8.0], [1.0, 0.0, 0.0]), None),
        ("beside", ray([-1.5, 0.0, 0.0], [0.0, 0.0, 1.0]), None),
        ("negative zeros", ray([0.25, 0.25, 0.0], [-0.0, -0.0, 1.0]), Some(4.0)),
    ];
    let rays: Vec<_> = cases.iter().map(|case| case.1).collect();
    let (hits, blocked) = (nearest(&scene, &rays), any(&scene, &rays));
    let mut failures = Vec::new();
    for (((what, _, expected), hit), blocked) in cases.iter().zip(&hits).zip(&blocked) {
        let found = (hit.triangle != NONE).then_some(hit.t);
        // 1/1e-15 is rounded.
        let right = match (found, expected) {
            (Some(t), Some(expected)) => (t - expected).abs() <= 1e-6 * expected,
            (found, expected) => found.is_none() && expected.is_none(),
        };
        if !right || (*blocked == 1) != expected.is_some() {
            failures.push(format!("{what}: {hit:?}, any {blocked}, expected {expected:?}"));
        }
    }
    assert!(failures.is_empty(), "hits of degenerate input: {failures:#?}");

    // Far away and huge: 1e6 m off, and 1e9 m across.
    for (center, size) in [(1e6f32, 4.0f32), (0.0, 1e9)] {
        let corner = |x: f32, y: f32| Vec3::new(center + size * x, center + size * y, center);
        let far = [corner(-1.0, -1.0), corner(3.0, -1.0), corner(-1.0, 3.0)];
        let scene = on_gpu(&soup(&[far]), source);
        let z = center - size;
        let rays = [
            ray([center, center, z], [0.0, 0.0, 1.0]),
            ray([center, center, z], [0.0, 0.0, -1.0]),
            ray([center - 2.0 * size, center, z], [0.0, 0.0, 1.0]),
        ];
        let hits = nearest(&scene, &rays);
        assert!(
            (hits[0].t - size).abs() <= 1e-6 * size,
            "triangle of {size} m at {center} m: the nearest hit is {:?}, expected t = {size} within 1e-6 of it",
            hits[0]
        );
        assert!(
            hits[1].triangle == NONE && hits[2].triangle == NONE,
            "triangle of {size} m at {center} m: rays away from and beside it hit {:?}, expected none",
            &hits[1..]
        );
        assert_eq!(
            any(&scene, &rays),
            [1, 0, 0],
            "triangle of {size} m at {center} m: any hits of rays to, away from and beside it"
        );
    }
}

#[test]
fn software_rays_with_degenerate_input() {
    degenerate_input(RaySource::Software);
}

#[test]
fn ray_query_with_degenerate_input() {
    if ray_query_gpu().is_some() {
        degenerate_input(RaySource::RayQuery);
    }
}

/// Rays that are no rays may answer anything, but they end, and the rays beside them are right.
/// (Of ray queries Vulkan does not even promise the end.)
#[test]
fn nan_rays_do_not_hang() {
    let mut scene = masked_soup();
    let walls = soup(&[wall(400.0)]).meshes.remove(0);
    scene.meshes.push(Mesh { material: 3, ..walls });
    scene.instances.push(Instance { mesh: 4, world_from_object: Affine3A::IDENTITY });
    let scene = on_gpu(&scene, RaySource::Software);
    let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 0.0, f32::MAX, f32::MIN_POSITIVE / 4.0];
    let mut rays = Vec::new();
    for x in bad {
        for y in bad {
            let odd = Vec3::new(x, 1.0, y);
            let good = ray([0.0, 0.0, 399.0], [0.0, 0.0, 1.0]);
            rays.extend([
                Ray { origin: odd, ..good },
                Ray { direction: odd.with_y(x), ..good },
                Ray { origin: odd, direction: odd, ..good },
                Ray { t_min: x, t_max: y, ..good },
                good,
            ]);
        }
    }
    let (hits, blocked) = (nearest(&scene, &rays), any(&scene, &rays));
    let n = scene.n_triangles();
    assert_each("nearest hits", &hits, &format!("none or of the {n} triangles"), |hit| {
        hit.triangle == NONE || hit.triangle < n
    });
    assert_each("any hits", &blocked, "0 or 1", |&blocked| blocked <= 1);
    let beside = "hits of the good ray beside bad ones";
    assert_each(&format!("nearest {beside}"), hits.iter().skip(4).step_by(5), "at t = 1", |hit| {
        hit.t == 1.0
    });
    assert_each(&format!("any {beside}"), blocked.iter().skip(4).step_by(5), "1", |&blocked| {
        blocked == 1
    });
}
