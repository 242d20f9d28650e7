//! The host seam's rays: both implementations against a brute-force oracle and each other.

use crate::harness::{Random, gpu, read, storage};
use glam::{Affine3A, DVec3, Vec3};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use lucerna::scene::{Instance, Material, Mesh, Scene};

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
            let t_max = if k % 3 == 0 { random.range(1.0, 10.0) } else { f32::MAX };
            Ray { origin, t_min: 0.0, direction, t_max }
        })
        .collect()
}

pub fn trace(scene: &GpuScene, question: RayQuestion, rays: &[Ray]) -> Vec<u8> {
    let gpu = gpu();
    let kernel = RayKernel::new(gpu, scene, question);
    let ray_buffer = storage(bytemuck::cast_slice(rays));
    let bytes = match question {
        RayQuestion::Nearest => size_of::<Hit>(),
        RayQuestion::Any => 4,
    };
    let answers = storage(&vec![0xcd; rays.len() * bytes]);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    let n = rays.len() as u32;
    kernel.record(gpu, &mut encoder, scene, &ray_buffer, &answers, n, None);
    gpu.queue.submit([encoder.finish()]);
    read(&answers)[..rays.len() * bytes].to_vec()
}

pub fn nearest(scene: &GpuScene, rays: &[Ray]) -> Vec<Hit> {
    bytemuck::pod_collect_to_vec(&trace(scene, RayQuestion::Nearest, rays))
}

pub fn any(scene: &GpuScene, rays: &[Ray]) -> Vec<u32> {
    bytemuck::pod_collect_to_vec(&trace(scene, RayQuestion::Any, rays))
}

/// Möller–Trumbore in f64. Also says how close the ray comes to an edge, in barycentric terms: there
/// f32 may decide either way.
fn oracle(triangles: &[[Vec3; 3]], ray: &Ray) -> (Option<f64>, bool) {
    let (origin, direction) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let mut nearest = None;
    let mut doubtful = false;
    for corners in triangles {
        let [a, b, c] = corners.map(|corner| corner.as_dvec3());
        let (edge_b, edge_c) = (b - a, c - a);
        let p = direction.cross(edge_c);
        let determinant = edge_b.dot(p);
        if determinant == 0.0 {
            continue;
        }
        let s: DVec3 = origin - a;
        let u = s.dot(p) / determinant;
        let q = s.cross(edge_b);
        let v = direction.dot(q) / determinant;
        let t = edge_c.dot(q) / determinant;
        let margin = u.min(v).min(1.0 - u - v);
        let inside = margin >= 0.0 && t > f64::from(ray.t_min) && t < f64::from(ray.t_max);
        let end = (t - f64::from(ray.t_max)).abs() < 1e-4 || t.abs() < 1e-4;
        doubtful |= margin.abs() < 1e-4 || (margin > -1e-4 && end);
        if inside && nearest.is_none_or(|found| t < found) {
            nearest = Some(t);
        }
    }
    (nearest, doubtful)
}

/// 1000 triangles, 20 000 rays. Distances: relative 1e-5, from f32 coordinates of size 12 (one
/// rounding is 6e-7 m) at distances from 1e-1 up; triangles seen edge-on are among the doubtful.
fn agrees_with_brute_force(rays_from: RaySource) {
    let triangles = random_triangles(1000, 3.0, 7);
    let options = GpuSceneOptions { rays: rays_from, ..Default::default() };
    let scene = GpuScene::new(gpu(), &soup(&triangles), options).unwrap();
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
        assert_eq!(blocked == 1, expected.is_some(), "any_hit of {ray:?}");
        assert_eq!(hit.triangle != NONE, expected.is_some(), "nearest_hit of {ray:?}: {hit:?}");
        if let Some(t) = expected {
            n_hits += 1;
            let error = (f64::from(hit.t) - t).abs();
            assert!(error < 2e-5 + 1e-5 * t, "{ray:?}: {hit:?}, expected t = {t}");
        }
    }
    assert!(n_hits > 5000 && n_doubtful < 1000, "{n_hits} hits, {n_doubtful} doubtful");
}

#[test]
fn software_rays_agree_with_brute_force() {
    agrees_with_brute_force(RaySource::Software);
}

#[test]
fn a_scene_without_triangles_is_never_hit() {
    let scene = GpuScene::new(gpu(), &soup(&[]), GpuSceneOptions::default()).unwrap();
    let rays = random_rays(100, 9);
    assert!(nearest(&scene, &rays).iter().all(|hit| hit.triangle == NONE));
    assert!(any(&scene, &rays).iter().all(|&blocked| blocked == 0));
}
