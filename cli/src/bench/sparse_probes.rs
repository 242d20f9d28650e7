// SPDX-License-Identifier: MIT OR Apache-2.0
//! `sparse-probes`: its passes over order × probes × receivers, and how fast its products read their matrices, by how fast the device copies.
//!
//! The bakes are made up: as many numbers as a real one has, whatever they are. A cluster of 1024 receivers has 20 probes, as in Sponza.

use super::Row;
use super::frames::{Bench, PICTURE, sum_of, with_light};
use glam::{UVec2, Vec2, Vec3};
use lucerna::blocking::wait;
use lucerna::components::LightVisibility;
use lucerna::components::sparse_probes::{
    BLOCK, BakedCluster, Numbers, Receiver, SparseBake, SparsePlan, SparseSettings,
};
use lucerna::gpu::Gpu;
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions, RaySource};
use lucerna::scene::{Camera, Scene, SceneFingerprint};
use lucerna::settings;
use lucerna::techniques::sparse_probes::{SparseProbesSettings, SparseProbesTechnique};
use std::error::Error;
use std::time::Instant;

const CLUSTER: u32 = 1024;
const PROBES_OF_CLUSTER: u32 = 20;
const COPYING: &str = "copying";
/// Bytes that are copied at once: more than caches hold; and how often.
const COPIED: u64 = 128 << 20;
const N_COPIES: u32 = 10;
/// Half of one, as two halfs.
const TWO_NUMBERS: u32 = 0x3800_3800;

/// What is measured: probes, order, receivers, vectors, numbers, order of radiance.
type Size = (u32, u32, u32, u32, Numbers, u32);

/// `quick`: few receivers, a small picture.
pub fn measure(
    gpu: &Gpu,
    scene: &Scene,
    camera: &Camera,
    source: RaySource,
    quick: bool,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let scene = with_light(scene);
    let options = settings!(GpuSceneOptions { rays: source, diffuse_only: true });
    let gpu_scene = GpuScene::new(gpu, &scene, options)?;
    let bench = Bench { gpu, scene: &gpu_scene, camera };
    let picture = if quick { PICTURE / 4 } else { PICTURE };
    let (halfs, bytes) = (Numbers::Halfs, Numbers::Bytes);
    let few = if quick { 20_000 } else { 120_000 };
    let many = if quick { 60_000 } else { 437_557 };
    let mut sizes: Vec<Size> = (0..8).map(|order| (160, order, many, 32, halfs, 0)).collect();
    sizes.push((160, 7, few, 32, halfs, 0));
    sizes.push((64, 4, few, 64, halfs, 0));
    sizes.push((64, 4, few, 64, bytes, 0));
    sizes.push((64, 4, few / 2, 64, halfs, 2));
    sizes.push((20, 4, few, 32, halfs, 0));
    sizes.push((160, 7, many, 32, bytes, 0));
    let copying = copy_speed(gpu)?;
    let mut rows = vec![Row::new("copying, bytes read and written", copying, "GB/s")];
    for size in sizes {
        // (One after the other: together they take gigabytes.)
        let bake = made_up(&gpu_scene, size);
        let technique = SparseProbesTechnique::new(
            gpu,
            &gpu_scene,
            &bake,
            gpu_scene.triangle_order(),
            SparseProbesSettings::default(),
            &LightVisibility::rays(),
        )?;
        let probes = technique.probes().bytes();
        let mut rigs = [bench.rig(picture, technique)?];
        let all = bench.run(&mut rigs, &["sparse_probes/light"])?;
        let (n_probes, order, n_receivers, n_vectors, numbers, radiance) = size;
        let name = format!(
            "order {order}, {n_probes} probes, {n_receivers} receivers, {n_vectors} vectors{}{}",
            if numbers == Numbers::Bytes { ", bytes" } else { "" },
            if radiance > 0 { format!(", radiance {radiance}") } else { String::new() }
        );
        let words = |of: fn(&BakedCluster) -> usize| -> f64 {
            bake.clusters.iter().map(|cluster| 4.0 * of(cluster) as f64).sum()
        };
        let read = [
            ("gather", words(|of| of.projection.len())),
            ("receive", words(|of| of.reconstruction.len())),
        ];
        let time = |pass: &str| sum_of(&all[0], &[pass]);
        let mut sum = 0.0;
        for pass in ["reflect", "project", "gather", "receive", "dilate", "shade"] {
            let ms = time(&format!("sparse_probes/{pass}"));
            sum += ms;
            rows.push(Row::new(format!("{pass}: {name}"), ms, "ms"));
            if let Some((_, bytes)) = read.iter().find(|(of, _)| *of == pass) {
                let speed = bytes / ms * 1e-6;
                let ratio = Some((speed / copying, COPYING));
                rows.push(Row {
                    ratio,
                    ..Row::new(format!("{pass}, its matrix: {name}"), speed, "GB/s")
                });
            }
        }
        rows.push(Row::new(format!("a frame: {name}"), sum, "ms"));
        rows.push(Row::new(format!("light: {name}"), time("sparse_probes/light"), "ms"));
        rows.push(Row::new(format!("memory: {name}"), probes as f64 * 1e-6, "MB"));
    }
    Ok(rows)
}

/// How many bytes a copy reads and writes in a second \[GB/s\]: the fastest of three.
fn copy_speed(gpu: &Gpu) -> Result<f64, Box<dyn Error>> {
    let buffer = |usage| {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("copied"),
            size: COPIED,
            usage,
            mapped_at_creation: false,
        })
    };
    let both = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let [from, to] = [buffer(both), buffer(both)];
    // (A system may give memory that was never written no place of its own.)
    let ones = vec![1u8; COPIED as usize];
    gpu.queue.write_buffer(&from, 0, &ones);
    gpu.queue.write_buffer(&to, 0, &ones);
    let mut best = f64::INFINITY;
    for _ in 0..4 {
        let begun = Instant::now();
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        for _ in 0..N_COPIES {
            encoder.copy_buffer_to_buffer(&from, 0, &to, 0, COPIED);
        }
        gpu.queue.submit([encoder.finish()]);
        wait(gpu)?;
        best = best.min(begun.elapsed().as_secs_f64());
    }
    Ok(2.0 * COPIED as f64 * f64::from(N_COPIES) / best * 1e-9)
}

/// A bake of this size, of a scene.
fn made_up(scene: &GpuScene, size: Size) -> SparseBake {
    let (n_probes, order, n_receivers, n_vectors, numbers, radiance) = size;
    let settings = settings!(SparseSettings {
        n_probes,
        order,
        n_vectors,
        numbers,
        radiance,
        ..Default::default()
    });
    let n_triangles = scene.n_triangles();
    let side = f64::from(n_receivers).sqrt().ceil() as u32;
    let hash = |ix: u32| ix.wrapping_mul(2_654_435_761) >> 8;
    let third = 65535 / 3;
    let receivers: Vec<Receiver> = (0..n_receivers)
        .map(|ix| Receiver {
            triangle: hash(ix) % n_triangles,
            weights: third | third << 16,
            texel: (ix % side) | (ix / side) << 16,
            side: 0,
        })
        .collect();
    let n_clusters = n_receivers.div_ceil(CLUSTER);
    let mut clusters: Vec<u32> = (0..n_clusters).map(|ix| ix * CLUSTER).collect();
    clusters.push(n_receivers);
    // (Each triangle covers a texel somewhere, so that pixels find light.)
    let corners = (0..n_triangles)
        .map(|ix| {
            let texel = hash(ix) % n_receivers;
            let at = Vec2::new((texel % side) as f32, (texel / side) as f32);
            [at, at + Vec2::X, at + Vec2::Y]
        })
        .collect();
    let plan = SparsePlan {
        scene: SceneFingerprint::default(),
        settings,
        radius: 1.0,
        placed: 0,
        size: UVec2::splat(side),
        texels_per_metre: 10.0,
        corners,
        probes: vec![Vec3::ZERO; n_probes as usize],
        radii: vec![1.0; n_receivers as usize],
        reach: vec![0x00ff_ffff; n_receivers as usize],
        receivers,
        clusters,
        seen: (0..n_probes * settings.n_directions).map(|ix| hash(ix) % n_receivers).collect(),
        coverage: [1, 0],
    };
    let own = PROBES_OF_CLUSTER.min(n_probes);
    let made = |ix: u32| {
        let n_receivers = plan.receivers_of(ix as usize).len() as u32;
        let mut cluster = BakedCluster {
            ix,
            n_receivers,
            n_vectors,
            energy: 1.0,
            n_samples: 1,
            n_valid: 1,
            n_hidden: 0,
            probes: (0..own).map(|k| (ix + k) % n_probes).collect(),
            projection: Vec::new(),
            reconstruction: Vec::new(),
        };
        let row = cluster.words_of_row(&settings) * n_vectors as usize;
        cluster.projection = vec![TWO_NUMBERS; row];
        let blocks = (n_receivers as usize).div_ceil(BLOCK) * settings.n_outputs() as usize;
        let n_words = (n_vectors as usize).div_ceil(numbers.in_word()) * BLOCK * blocks;
        cluster.reconstruction = vec![TWO_NUMBERS; n_words];
        cluster
    };
    let clusters = (0..n_clusters).map(made).collect();
    SparseBake { plan, shard: [0, 1], clusters }
}
