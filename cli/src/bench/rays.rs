// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traversal: the kernels compared with obvhs on one CPU thread, with the same tree and the same
//! rays.

use super::{Row, timed};
use glam::{Vec3, Vec3A};
use lucerna::blocking::read_buffer;
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{Bvh, GpuScene, GpuSceneOptions, RaySource, WorldTriangles, build_obvhs};
use lucerna::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use lucerna::scene::{Camera, Projection, Scene};
use lucerna::settings;
use std::error::Error;
use std::time::{Duration, Instant};
use wgpu::util::DeviceExt;

/// Rays along each side of the picture.
const SIDE: u32 = 1024;
/// The fastest of this many rounds counts: the others were disturbed.
const ROUNDS: usize = 5;
const BASELINE: &str = "obvhs, 1 thread";

pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let world = WorldTriangles::of(scene);
    let begun = Instant::now();
    Bvh::build(&world.positions);
    let build = begun.elapsed();
    let gpu_scene =
        GpuScene::new(gpu, scene, settings!(GpuSceneOptions { rays: source, diffuse_only: true }))?;
    let memory = gpu_scene.memory();
    let per_triangle =
        (memory.bvh_nodes + memory.triangles) as f64 / f64::from(gpu_scene.n_triangles().max(1));
    let mut rows = vec![
        Row {
            name: "triangles".into(),
            value: f64::from(gpu_scene.n_triangles()),
            unit: "",
            ratio: None,
        },
        Row {
            name: "BVH build, 1 thread".into(),
            value: build.as_secs_f64() * 1e3,
            unit: "ms",
            ratio: None,
        },
        Row {
            name: "BVH and triangles".into(),
            value: per_triangle,
            unit: "bytes/triangle",
            ratio: None,
        },
    ];
    let cpu = CpuScene::new(&world.positions);
    let primary = primary_rays(camera);
    let hits = gpu_hits(gpu, &gpu_scene, &primary)?;
    let diffuse = diffuse_rays(&primary, &hits);
    for (name, rays) in [("primary", &primary), ("diffuse", &diffuse)] {
        if rays.is_empty() {
            continue;
        }
        let mut best = [Duration::MAX; 3];
        // In turns, so that a disturbance affects all of them.
        for _ in 0..ROUNDS {
            best[0] = best[0].min(cpu.time(rays));
            best[1] = best[1].min(gpu_time(gpu, &gpu_scene, RayQuestion::Nearest, rays)?);
            best[2] = best[2].min(gpu_time(gpu, &gpu_scene, RayQuestion::Any, rays)?);
        }
        let [baseline, nearest, any] =
            best.map(|time| rays.len() as f64 / time.as_secs_f64() / 1e6);
        let row = |what: String, value, ratio| Row { name: what, value, unit: "Mrays/s", ratio };
        rows.push(row(format!("{name}, {BASELINE}"), baseline, None));
        rows.push(row(
            format!("{name}, nearest hit"),
            nearest,
            Some((nearest / baseline, BASELINE)),
        ));
        rows.push(row(format!("{name}, any hit"), any, Some((any / baseline, BASELINE))));
    }
    Ok(rows)
}

/// obvhs's tree with its triangles in the order of the leaves.
struct CpuScene {
    tree: obvhs::cwbvh::CwBvh,
    triangles: Vec<obvhs::rt_triangle::RtTriangle>,
}

impl CpuScene {
    fn new(positions: &[[Vec3; 3]]) -> Self {
        let tree = build_obvhs(positions);
        let triangles = tree
            .primitive_indices
            .iter()
            .map(|&ix| {
                let [a, b, c] = positions[ix as usize].map(Vec3A::from);
                obvhs::rt_triangle::RtTriangle::new(a, b, c)
            })
            .collect();
        Self { tree, triangles }
    }

    fn time(&self, rays: &[Ray]) -> Duration {
        let begun = Instant::now();
        let mut n_hits = 0u32;
        for ray in rays {
            let ray = obvhs::ray::Ray::new_inf(ray.origin.into(), ray.direction.into());
            let mut hit = obvhs::ray::RayHit::none();
            if self.tree.ray_traverse(ray, &mut hit, |ray, ix| self.triangles[ix].intersect(ray)) {
                n_hits += 1;
            }
        }
        std::hint::black_box(n_hits);
        begun.elapsed()
    }
}

/// Rays through the picture, in tiles of 8×8.
fn primary_rays(camera: &Camera) -> Vec<Ray> {
    let right = camera.forward.cross(camera.up);
    let half = match camera.projection {
        Projection::Perspective { vertical_fov } => (0.5 * vertical_fov).tan(),
        Projection::Orthographic { half_height } => half_height,
    };
    let tiles = SIDE / 8;
    (0..SIDE * SIDE)
        .map(|ix| {
            let (tile, inside) = (ix / 64, ix % 64);
            let x = tile % tiles * 8 + inside % 8;
            let y = tile / tiles * 8 + inside / 8;
            let at = |k: u32| (k as f32 + 0.5) / SIDE as f32 * 2.0 - 1.0;
            let offset = right * (half * at(x)) - camera.up * (half * at(y));
            let direction = (camera.forward + offset).normalize();
            Ray { origin: camera.position, t_min: 0.0, direction, t_max: f32::MAX }
        })
        .collect()
}

/// A random direction from each point that the primary rays hit. Directions cover the whole sphere:
/// half of them would point into the surface and end at once, which no path tracer's do, so those
/// are reversed.
fn diffuse_rays(primary: &[Ray], hits: &[Hit]) -> Vec<Ray> {
    let mut state = 1u64;
    let mut random = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    primary
        .iter()
        .zip(hits)
        .filter(|(_, hit)| hit.triangle != NONE)
        .map(|(ray, hit)| {
            let z = 2.0 * random() - 1.0;
            let phi = std::f32::consts::TAU * random();
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let direction = Vec3::new(radius * phi.cos(), radius * phi.sin(), z);
            // Back towards where the primary ray came from.
            let direction = if direction.dot(ray.direction) > 0.0 { -direction } else { direction };
            let origin = ray.origin + ray.direction * (hit.t * 0.999);
            Ray { origin, t_min: 0.0, direction, t_max: f32::MAX }
        })
        .collect()
}

fn gpu_hits(gpu: &Gpu, scene: &GpuScene, rays: &[Ray]) -> Result<Vec<Hit>, Box<dyn Error>> {
    let (_, answers) = run(gpu, scene, RayQuestion::Nearest, rays)?;
    let bytes = read_buffer(gpu, &answers)?;
    Ok(bytes.chunks_exact(size_of::<Hit>()).map(bytemuck::pod_read_unaligned).collect())
}

fn gpu_time(
    gpu: &Gpu,
    scene: &GpuScene,
    question: RayQuestion,
    rays: &[Ray],
) -> Result<Duration, Box<dyn Error>> {
    Ok(run(gpu, scene, question, rays)?.0)
}

/// Traces all rays twice and times the second run: the first compiles.
fn run(
    gpu: &Gpu,
    scene: &GpuScene,
    question: RayQuestion,
    rays: &[Ray],
) -> Result<(Duration, wgpu::Buffer), Box<dyn Error>> {
    let kernel = RayKernel::new(gpu, scene, question);
    let ray_buffer = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("rays"),
        contents: bytemuck::cast_slice(rays),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let answers = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("answers"),
        size: (rays.len() * size_of::<Hit>()) as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut time = Duration::MAX;
    for _ in 0..2 {
        time = timed(gpu, |recorder| {
            Ok(kernel.record(recorder, scene, &ray_buffer, &answers, rays.len() as u32)?)
        })?;
    }
    Ok((time, answers))
}
