// SPDX-License-Identifier: MIT OR Apache-2.0
//! The white furnace: a closed box whose walls reflect ρ and emit L_e. Every point then has the
//! radiance L_e/(1 − ρ) in every direction, and of n reflections L_e·ρⁿ.

use crate::harness::{assert_each, ray_query_gpu};
use crate::support::{batches, lambert, on_gpu, room, scene, settings};
use glam::{DVec3, Vec3};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{Camera, Material, Projection, Scene};
use lucerna::techniques::reference::Channel;

const EMISSION: [f32; 3] = [0.7, 1.0, 0.25];

/// 2 m × 1 m × 3 m, seen from inside.
fn box_from_inside(albedo: f32) -> Scene {
    let material = Material { emission: EMISSION.into(), ..lambert([albedo; 3]) };
    scene(room([2.0, 1.0, 3.0], 0), vec![material])
}

fn camera() -> Camera {
    let forward = Vec3::new(0.3, -0.2, 1.0).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    Camera {
        name: String::new(),
        position: Vec3::new(0.7, 0.6, 0.4),
        forward,
        up: right.cross(forward),
        projection: Projection::Perspective { vertical_fov: 1.9 },
    }
}

/// With a limit of n bounces light of up to n + 1 reflections is counted:
/// L_e·(1 − ρⁿ⁺²)/(1 − ρ). Indirect light alone, a part of it, is given 0.75 %.
fn furnace(albedo: f32, n_bounces: u32, n_samples: u32, source: RaySource) {
    let scene = on_gpu(&box_from_inside(albedo), true, source);
    let found = batches(&scene, &camera(), &settings(8, 8, n_bounces), n_samples);
    let (emission, rho) = (Vec3::from(EMISSION).as_dvec3(), f64::from(albedo));
    let series = |from: i32, n: i32| emission * (rho.powi(from) - rho.powi(n)) / (1.0 - rho);
    let n = n_bounces as i32 + 2;
    let name = |what| format!("furnace {albedo}, {n_bounces} bounces, {what}");
    found.estimate(Channel::Beauty).check_all(&name("beauty"), series(0, n), 0.005);
    found.estimate(Channel::Emitted).check_all(&name("emitted"), emission, 1e-5);
    found.estimate(Channel::Direct).check_all(&name("direct"), emission * rho, 0.005);
    let indirect = found.estimate(Channel::Indirect);
    if n_bounces == 0 {
        assert_each(&name("indirect light of pixels"), &indirect.pixels, "black", |&pixel| {
            pixel == DVec3::ZERO
        });
    } else {
        indirect.check_all(&name("indirect"), series(2, n), 0.0075);
    }
}

#[test]
fn furnace_of_albedo_a_half() {
    furnace(0.5, 20, 4096, RaySource::Software);
}

#[test]
fn furnace_of_albedo_nine_tenths() {
    furnace(0.9, 200, 16384, RaySource::Software);
}

/// The limit on bounces cuts the series where it says, before and after Russian roulette sets in.
#[test]
fn furnace_stops_at_the_last_bounce() {
    for n_bounces in [0, 1, 6] {
        furnace(0.9, n_bounces, 2048, RaySource::Software);
    }
}

#[test]
fn ray_query_furnace() {
    if ray_query_gpu().is_some() {
        furnace(0.5, 20, 4096, RaySource::RayQuery);
    }
}
