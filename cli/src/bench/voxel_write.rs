// SPDX-License-Identifier: MIT OR Apache-2.0
//! Write strategies: tables 7.2 to 7.4 of `voxel-rt`'s source, and the write alone.

use super::{Row, timed};
use glam::{UVec3, Vec3};
use lucerna::blocking::read_buffer;
use lucerna::components::voxel_light::{
    Injection, InjectionSource, RUN_SIDE, VoxelInjector, VoxelIrradiance, VoxelSample,
    WriteStrategy, sparse_grid,
};
use lucerna::components::voxels::VoxelGrid;
use lucerna::gpu::{Gpu, Recorder};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource, WorldTriangles};
use lucerna::rays::{Hit, NONE, Ray, RayKernel, RayQuestion};
use lucerna::scene::{Light, Scene};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use std::error::Error;
use std::time::Duration;
use wgpu::util::DeviceExt;

/// Cells along the longest axis.
const GRIDS: [u32; 3] = [64, 128, 256];
/// Rays along each side of the square.
const RAYS: [u32; 4] = [256, 512, 1024, 2048];
/// Strategies take turns; the fastest of this many rounds counts.
const ROUNDS: usize = 5;
const BASELINE: &str = "store";
/// The light's distance to the wall it touches, in cells of the finest grid.
const TOUCHING: f32 = 0.25;

/// `quick`: the smaller half of the sizes.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    source: RaySource,
    quick: bool,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let (grids, rays) = if quick { (&GRIDS[..2], &RAYS[..2]) } else { (&GRIDS[..], &RAYS[..]) };
    let mut rows = Vec::new();
    for (place, position) in places(scene) {
        let light = Light::Point { position, intensity: Vec3::ONE, range: None };
        let lit = Scene { lights: vec![light.clone()], ..scene.clone() };
        let options = settings!(GpuSceneOptions { rays: source, diffuse_only: true });
        let gpu_scene = GpuScene::new(gpu, &lit, options)?;
        for &cells in grids {
            for &n_rays in rays {
                let name = format!("{place}, {cells}^3, {n_rays}^2");
                measure_one(gpu, &gpu_scene, &light, cells, n_rays, &name, &mut rows)?;
            }
        }
    }
    Ok(rows)
}

/// The middle of the scene's box, and a point close to the first wall below it.
fn places(scene: &Scene) -> [(&'static str, Vec3); 2] {
    let (low, high) = WorldTriangles::of(scene).bounds();
    let middle = 0.5 * (low + high);
    let cell = (high - low).max_element() / GRIDS[2] as f32;
    let wall = Vec3::new(low.x + TOUCHING * cell, middle.y, middle.z);
    [("favourable", middle), ("unfavourable", wall)]
}

fn measure_one(
    gpu: &Gpu,
    scene: &GpuScene,
    light: &Light,
    cells: u32,
    n_rays: u32,
    name: &str,
    rows: &mut Vec<Row>,
) -> Result<(), Box<dyn Error>> {
    let hits = hits_of_light(gpu, scene, light, n_rays)?;
    let (grid, structure, samples) = voxels_of_hits(scene, cells, &hits);
    let structure = buffer(gpu, bytemuck::cast_slice(&structure));
    let sample_buffer = buffer(gpu, bytemuck::cast_slice(&samples));
    let largest_irradiance = scene.facts().punctual_peaks[0].at(0.5 * grid.cell);
    let traced =
        Injection { source: InjectionSource::Light(0), n_rays, seed: 1, largest_irradiance };
    let written = Injection {
        source: InjectionSource::Samples(&sample_buffer, samples.len() as u32),
        ..traced
    };
    let rigs = WriteStrategy::ALL
        .into_iter()
        .map(|strategy| {
            let volume = VoxelIrradiance::new(gpu, grid, &structure, strategy)?;
            let injector = VoxelInjector::new(gpu, scene, strategy);
            Ok((volume, injector))
        })
        .collect::<Result<Vec<_>, Box<dyn Error>>>()?;
    for (what, injection) in [("inject", traced), ("write", written)] {
        let mut best = [Duration::MAX; WriteStrategy::ALL.len()];
        // The first round compiles. In turns, so that a disturbance affects all of them.
        for round in 0..=ROUNDS {
            for (best, (volume, injector)) in best.iter_mut().zip(&rigs) {
                let time = timed(gpu, |recorder| {
                    Ok(injector.record(recorder, scene, volume, &[injection])?)
                })?;
                if round > 0 {
                    *best = (*best).min(time);
                }
            }
        }
        for (strategy, time) in WriteStrategy::ALL.into_iter().zip(best) {
            let ratio = time.as_secs_f64() / best[0].as_secs_f64();
            rows.push(Row {
                name: format!("{name}, {what}, {}", label(strategy)),
                value: time.as_secs_f64() * 1e3,
                unit: "ms",
                ratio: (strategy != WriteStrategy::Store).then_some((ratio, BASELINE)),
            });
        }
    }
    Ok(())
}

fn label(strategy: WriteStrategy) -> &'static str {
    match strategy {
        WriteStrategy::Store => BASELINE,
        WriteStrategy::MovingAverage => "moving average",
        WriteStrategy::Max => "max",
        WriteStrategy::Exact => "exact",
    }
}

/// A hit's position and triangle, in the order in which the kernel's invocations find them.
struct Place {
    position: Vec3,
    value: f32,
}

/// First hits of stratified rays, in blocks as an invocation traces them.
fn hits_of_light(
    gpu: &Gpu,
    scene: &GpuScene,
    light: &Light,
    n_rays: u32,
) -> Result<Vec<Place>, Box<dyn Error>> {
    let Light::Point { position, .. } = *light else { return Ok(Vec::new()) };
    let blocks = n_rays / RUN_SIDE;
    let rays: Vec<Ray> = (0..n_rays * n_rays)
        .map(|ix| {
            let (block, inside) = (ix / (RUN_SIDE * RUN_SIDE), ix % (RUN_SIDE * RUN_SIDE));
            let x = block % blocks * RUN_SIDE + inside % RUN_SIDE;
            let y = block / blocks * RUN_SIDE + inside / RUN_SIDE;
            let at = |k: u32| (k as f32 + 0.5) / n_rays as f32;
            let z = 1.0 - 2.0 * at(x);
            let radius = (1.0 - z * z).max(0.0).sqrt();
            let phi = std::f32::consts::TAU * at(y);
            let direction = Vec3::new(radius * phi.cos(), radius * phi.sin(), z);
            Ray { origin: position, t_min: 0.0, direction, t_max: f32::MAX }
        })
        .collect();
    let kernel = RayKernel::new(gpu, scene, RayQuestion::Nearest);
    let ray_buffer = buffer(gpu, bytemuck::cast_slice(&rays));
    let answers = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("hits"),
        size: (rays.len() * size_of::<Hit>()) as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let recorder = &mut Recorder::new(gpu, &mut encoder);
        kernel.record(recorder, scene, &ray_buffer, &answers, rays.len() as u32)?;
    }
    gpu.queue.submit([encoder.finish()]);
    let bytes = read_buffer(gpu, &answers)?;
    let hits = bytes.chunks_exact(size_of::<Hit>()).map(bytemuck::pod_read_unaligned::<Hit>);
    Ok(rays
        .iter()
        .zip(hits)
        .filter(|(_, hit)| hit.triangle != NONE)
        // The cosine does not matter to the write.
        .map(|(ray, hit)| Place {
            position: ray.origin + hit.t * ray.direction,
            value: (hit.t * hit.t).recip().min(f32::MAX),
        })
        .collect())
}

/// The grid over the scene with one value a voxel, occupied at the hits and around them, and the hits as samples.
fn voxels_of_hits(
    scene: &GpuScene,
    cells: u32,
    hits: &[Place],
) -> (VoxelGrid, Vec<[u32; 2]>, Vec<VoxelSample>) {
    let (low, high) = scene.bounds();
    let cell = (high - low).max_element() / (cells - 2) as f32;
    let origin = low - cell;
    let cell_of = |position: Vec3| ((position - origin) / cell).floor().as_uvec3();
    let size = cell_of(high) + 2;
    let mut near = vec![false; size.element_product() as usize];
    let index = |c: UVec3| ((c.z * size.y + c.y) * size.x + c.x) as usize;
    for hit in hits {
        // Jittered rays hit the neighbours too.
        for corner in 0..8u32 {
            let side = UVec3::new(corner & 1, corner >> 1 & 1, corner >> 2).as_vec3() - 0.5;
            let cell = cell_of(hit.position + side * cell).min(size - 1);
            near[index(cell)] = true;
        }
    }
    let occupied: Vec<UVec3> = (0..near.len() as u32)
        .filter(|&ix| near[ix as usize])
        .map(|ix| UVec3::new(ix % size.x, ix / size.x % size.y, ix / (size.x * size.y)))
        .collect();
    let (grid, structure) = sparse_grid(origin, cell, size, 1, &occupied);
    let n_bricks = grid.bricks.element_product() as usize;
    let mut slot_of = vec![u32::MAX; near.len()];
    for (slot, &[packed, _]) in structure[n_bricks..].iter().enumerate() {
        let cell = UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20);
        slot_of[index(cell)] = slot as u32;
    }
    let largest = scene.facts().punctual_peaks[0].at(0.5 * cell);
    let samples = hits
        .iter()
        .map(|hit| VoxelSample {
            value: Vec3::splat(hit.value.min(largest)),
            record: slot_of[index(cell_of(hit.position).min(size - 1))],
        })
        .collect();
    (grid, structure, samples)
}

fn buffer(gpu: &Gpu, contents: &[u8]) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("voxel bench"),
        contents,
        usage: wgpu::BufferUsages::STORAGE,
    })
}
