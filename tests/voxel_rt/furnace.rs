//! Closed boxes whose light is known.

use crate::harness::{gpu, read};
use crate::support::on_gpu;
use glam::{Affine3A, Vec3};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{Instance, Material, Mesh, Scene};
use lucerna::voxel_rt::{FaceLight, VoxelRt, VoxelRtSettings};

/// A box whose walls face inwards, half a side of 1 m, a little turned away from the grid's axes.
pub fn furnace(albedo: f32, emission: f32) -> Scene {
    let corners: Vec<Vec3> = (0..8)
        .map(|k| Vec3::new([-1.0, 1.0][k & 1], [-1.0, 1.0][k >> 1 & 1], [-1.0, 1.0][k >> 2]))
        .collect();
    let quads =
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let material = Material {
        base_color: Vec3::splat(albedo).extend(1.0),
        emission: Vec3::splat(emission),
        ..Material::default()
    };
    Scene {
        meshes: vec![Mesh { positions: corners, triangles, ..Mesh::default() }],
        instances: vec![Instance { mesh: 0, world_from_object: Affine3A::from_rotation_y(0.3) }],
        materials: vec![material],
        ..Scene::default()
    }
}

/// Runs frames of the technique and returns the records of all voxels.
pub fn records(scene: &Scene, settings: VoxelRtSettings, n_frames: u32) -> Vec<FaceLight> {
    let gpu = gpu();
    let gpu_scene = on_gpu(scene, true, RaySource::Software);
    let mut technique = VoxelRt::new(gpu, &gpu_scene, settings, Vec3::ZERO).unwrap();
    for _ in 0..n_frames {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        technique.update(gpu, &mut encoder, &gpu_scene, Vec3::ZERO).unwrap();
        gpu.queue.submit([encoder.finish()]);
    }
    let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&read(technique.counts(0)));
    assert_eq!(counts[1], 0, "voxels without room");
    let n_faces = if settings.anisotropic { 6 } else { 1 };
    let light: Vec<FaceLight> = bytemuck::pod_collect_to_vec(&read(technique.light().0));
    light[..(counts[0] * n_faces) as usize].to_vec()
}

#[test]
fn furnace_converges() {
    let settings = VoxelRtSettings { resolution: 16, points_per_face: 4, ..Default::default() };
    let light = records(&furnace(0.5, 1.0), settings, 64);
    eprintln!("{} records", light.len());
    let mut sums = [0.0f64; 3];
    for record in &light {
        let n = f64::from(record.n_hits);
        sums[0] += n;
        sums[1] += n * f64::from(record.direct.x);
        sums[2] += n * f64::from(record.indirect.x);
    }
    eprintln!("hits {} direct {} indirect {}", sums[0], sums[1] / sums[0], sums[2] / sums[0]);
    panic!();
}
