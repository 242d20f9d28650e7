// SPDX-License-Identifier: MIT OR Apache-2.0
//! Voxelization: compute compared with the rasteriser; how many voxels the rasteriser misses; large
//! triangles compared with small ones.

use super::Row;
use glam::{Affine3A, UVec3, Vec3};
use lucerna::blocking::{read_buffer, wait};
use lucerna::components::voxels::{
    RasterMethod, RasterVoxelizer, Resolution, Triangles, VoxelAttributes, VoxelGrid, Voxelizer,
    grid_for_bounds, n_bricks,
};
use lucerna::gpu::{Gpu, Recorder};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Instance, Material, Mesh, Scene};
use lucerna::settings;
use std::error::Error;
use std::time::{Duration, Instant};

/// The fastest of this many rounds counts; one round before them compiles.
const ROUNDS: usize = 5;
const COMPUTE: &str = "compute";

pub fn measure(gpu: &Gpu, scene: &Scene, source: RaySource) -> Result<Vec<Row>, Box<dyn Error>> {
    let options = settings!(GpuSceneOptions { rays: source, ..Default::default() });
    let gpu_scene = GpuScene::new(gpu, scene, options)?;
    let mut rows = Vec::new();
    for n in [64, 128, 256] {
        let (min, max) = gpu_scene.bounds();
        let grid = grid_for_bounds(min, max, Resolution::Longest(n), 6, None)?;
        rows.extend(of_grid(gpu, &gpu_scene, grid)?);
    }
    let few = wall_time(gpu, 1, options)?;
    let many = wall_time(gpu, 71, options)?;
    rows.push(Row::new("256^3, wall of 10082 triangles", ms(many), "ms"));
    rows.push(Row {
        ratio: Some((few.as_secs_f64() / many.as_secs_f64(), "10082 triangles")),
        ..Row::new("256^3, the same wall of 2 triangles", ms(few), "ms")
    });
    Ok(rows)
}

fn ms(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

fn of_grid(gpu: &Gpu, scene: &GpuScene, grid: VoxelGrid) -> Result<Vec<Row>, Box<dyn Error>> {
    let n = grid.size.max_element();
    let voxelizer = Voxelizer::new(gpu, scene, grid)?;
    let compute = time(gpu, |recorder| Ok(voxelizer.record(recorder, scene, Triangles::All)?))?;
    let words: Vec<[u32; 2]> =
        bytemuck::pod_collect_to_vec(&read_buffer(gpu, voxelizer.structure())?);
    let exact: Vec<u32> = words[..n_bricks(&grid) as usize].iter().map(|word| word[0]).collect();
    let n_exact = ones(&exact).max(1);
    let attributes = VoxelAttributes::new(gpu, scene, &voxelizer)?;
    let records = time(gpu, |recorder| Ok(attributes.record(recorder, scene, &voxelizer)?))?;
    let mut rows = vec![
        Row::new(format!("{n}^3, voxels"), n_exact as f64, ""),
        Row::new(format!("{n}^3, compute, with its structure"), ms(compute), "ms"),
        Row::new(format!("{n}^3, attributes of 6 faces"), ms(records), "ms"),
    ];
    for (name, method) in [
        ("3 axes", RasterMethod::ThreeAxes),
        ("dominant axis", RasterMethod::DominantAxis),
        ("dominant axis, rectangles", RasterMethod::BoundingQuad),
    ] {
        let raster = RasterVoxelizer::new(gpu, scene, grid, method)?;
        let taken = time(gpu, |recorder| Ok(raster.record(recorder, scene)?))?;
        let mut bits: Vec<u32> = bytemuck::pod_collect_to_vec(&read_buffer(gpu, raster.bits())?);
        bits.truncate(exact.len());
        let share = |of: &[u32], without: &[u32]| {
            let left: Vec<u32> = of.iter().zip(without).map(|(a, b)| a & !b).collect();
            100.0 * ones(&left) as f64 / n_exact as f64
        };
        rows.push(Row {
            ratio: Some((taken.as_secs_f64() / compute.as_secs_f64(), COMPUTE)),
            ..Row::new(format!("{n}^3, raster, {name}"), ms(taken), "ms")
        });
        rows.push(Row::new(format!("{n}^3, raster, {name}, missed"), share(&exact, &bits), "%"));
        rows.push(Row::new(format!("{n}^3, raster, {name}, too many"), share(&bits, &exact), "%"));
    }
    Ok(rows)
}

fn ones(words: &[u32]) -> u64 {
    words.iter().map(|word| u64::from(word.count_ones())).sum()
}

/// Wall time of submitting and waiting.
fn time(
    gpu: &Gpu,
    record: impl Fn(&mut Recorder) -> Result<(), Box<dyn Error>>,
) -> Result<Duration, Box<dyn Error>> {
    let mut best = Duration::MAX;
    for _ in 0..=ROUNDS {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        record(&mut Recorder::new(gpu, &mut encoder))?;
        let begun = Instant::now();
        gpu.queue.submit([encoder.finish()]);
        wait(gpu)?;
        best = best.min(begun.elapsed());
    }
    Ok(best)
}

/// Time to voxelize a wall of `n` × `n` squares of two triangles, which covers 250 × 250 cells of a
/// grid of 256³.
fn wall_time(gpu: &Gpu, n: u32, options: GpuSceneOptions) -> Result<Duration, Box<dyn Error>> {
    let at = |k: u32| k as f32 / n as f32 * 250.0 + 3.1;
    let positions =
        (0..=n).flat_map(|y| (0..=n).map(move |x| Vec3::new(at(x), at(y), 100.3))).collect();
    let corner = |x: u32, y: u32| y * (n + 1) + x;
    let triangles = (0..n * n)
        .map(|k| (k % n, k / n))
        .flat_map(|(x, y)| {
            let [a, b] = [corner(x, y), corner(x + 1, y)];
            let [c, d] = [corner(x + 1, y + 1), corner(x, y + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let scene = Scene {
        meshes: vec![Mesh { positions, triangles, ..Mesh::default() }],
        instances: vec![Instance { mesh: 0, world_from_object: Affine3A::IDENTITY }],
        materials: vec![Material::default()],
        ..Scene::default()
    };
    let scene = GpuScene::new(gpu, &scene, options)?;
    let size = UVec3::splat(256);
    let grid = grid_for_bounds(Vec3::ZERO, Vec3::splat(253.0), Resolution::Size(size), 6, None)?;
    let voxelizer = Voxelizer::new(gpu, &scene, grid)?;
    time(gpu, |recorder| Ok(voxelizer.record(recorder, &scene, Triangles::All)?))
}
