// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the kernel voxel_light/gather finds, face by face, against closed forms.

use crate::harness::{KeepNan, assert_each, read};
use crate::session::{Session, camera, upload};
use crate::support::{floor, lambert, scene};
use glam::{DVec3, Vec3};
use lucerna::components::voxel_light::{DirectLight, FaceLight, RaysInjected};
use lucerna::scene::{Light, Scene};
use lucerna::settings;
use lucerna::techniques::voxel_rt::VoxelRtSettings;

const HEIGHT: f64 = 0.9;
const LIGHT: DVec3 = DVec3::new(0.3, HEIGHT, -0.2);
const INTENSITY: f64 = 2.0;

/// A floor of 4 m × 4 m with a point light above it, and nothing to reflect it.
fn lit_floor() -> Scene {
    let mut world = scene(vec![floor(2.0, 0.0, 0)], vec![lambert([0.5; 3])]);
    world.lights.push(Light::Point {
        position: LIGHT.as_vec3(),
        intensity: Vec3::splat(INTENSITY as f32),
        range: None,
    });
    world
}

/// I·cos θ/d² on the floor.
fn irradiance(x: f64, z: f64) -> f64 {
    let square = (DVec3::new(x, 0.0, z) - LIGHT).length_squared();
    INTENSITY * HEIGHT / square.powf(1.5)
}

/// The mean over the part of a cell's floor that lies on the 4 m × 4 m, each piece weighing `weight(E)`; None
/// where there is less than a quarter of a cell.
fn mean_irradiance(corner: [f64; 2], cell: f64, weight: fn(f64) -> f64) -> Option<f64> {
    const N: u32 = 32;
    let (mut sum, mut total, mut n) = (0.0, 0.0, 0);
    for ix in 0..N * N {
        let at = |k: u32, corner: f64| corner + cell * (f64::from(k) + 0.5) / f64::from(N);
        let (x, z) = (at(ix % N, corner[0]), at(ix / N, corner[1]));
        if x.abs() < 2.0 && z.abs() < 2.0 {
            let e = irradiance(x, z);
            sum += weight(e) * e;
            total += weight(e);
            n += 1;
        }
    }
    (4 * n >= N * N).then(|| sum / total)
}

/// Compares the direct light of each face that looks up with the mean; returns how many were compared.
fn check_direct(direct: DirectLight, weight: fn(f64) -> f64, tolerance: f64) {
    let world = upload(&lit_floor());
    let settings = settings!(VoxelRtSettings { resolution: 20, direct, ..Default::default() });
    let mut session = Session::new(&world, &camera([0.0, 1.5, 1.9], [0.0, 0.0, 0.0]), settings);
    session.run(&world, 260);
    let buffers = session.technique.buffers();
    let lights: Vec<FaceLight> = bytemuck::pod_collect_to_vec(&read(&buffers.lights));
    let words: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read(&buffers.structure));
    let n_voxels = bytemuck::pod_collect_to_vec::<_, u32>(&read(&buffers.counts[0]))[0] as usize;
    let grid = session.technique.grid(0);
    let slots = &words[grid.bricks.element_product() as usize..][..n_voxels];
    let cell = f64::from(grid.cell);
    let (mut n, mut worst) = (0, 0.0f64);
    for (slot, &[packed, _]) in slots.iter().enumerate() {
        let at = |axis: usize, k: u32| f64::from(grid.origin[axis]) + cell * f64::from(k);
        let corner = [at(0, packed & 1023), at(2, packed >> 20)];
        let faces = &lights[6 * slot..6 * slot + 6];
        // Nothing is reflected, and from the sides the floor is not to be seen.
        let what = format!("{direct:?}, cell at {corner:?}");
        assert_each(
            &format!("{what}: lights of faces"),
            faces,
            "without reflected light",
            |face| face.indirect == Vec3::ZERO && face.feedback == Vec3::ZERO,
        );
        for side in [0, 1, 4, 5] {
            assert_eq!(
                faces[side].n_hits, 0.0,
                "{what}: hits of side {side}, from which the floor is not seen"
            );
        }
        let Some(expected) = mean_irradiance(corner, cell, weight) else { continue };
        let up = faces[2];
        let inside = [0, 1].map(|k| (corner[k] + cell).min(2.0) - corner[k].max(-2.0));
        let covered = inside[0] * inside[1] / (cell * cell);
        assert!(
            (f64::from(up.n_hits / up.n_rays) - covered).abs() < 0.05,
            "{what}: {} of the upper face's rays hit, expected {covered} within 0.05",
            up.n_hits / up.n_rays
        );
        worst = worst.max_nan((f64::from(up.direct.y) / expected - 1.0).abs());
        n += 1;
    }
    eprintln!("{direct:?}: {n} faces, off by {worst} at most");
    assert!(
        n > 200 && worst < tolerance,
        "{direct:?}: {n} faces are compared, expected above 200; direct light is off by {worst} of the mean irradiance at most, expected below {tolerance}"
    );
}

/// Faces draw points evenly: the mean of the irradiance over the area. 260 points of a scrambled net
/// over a cell in which E varies by up to a third.
#[test]
fn faces_find_the_mean_irradiance_of_their_floor() {
    check_direct(DirectLight::PerFace, |_| 1.0, 0.01);
}

/// Rays of a light arrive in proportion to E: the mean weighs by it (`voxel_light/inject`). 260 frames of
/// 128² rays, a fifth of them below the light.
#[test]
fn deposits_are_the_mean_irradiance_of_what_arrives() {
    let rays = lucerna::settings!(RaysInjected { n_rays: 128, ..Default::default() });
    check_direct(DirectLight::FromLights(rays), |e| e, 0.02);
}
