//! The white furnace: a closed box whose walls reflect ρ and emit L_e; every point has the radiance
//! L_e/(1 − ρ) in every direction.

use crate::session::{camera, upload};
use crate::support::{lambert, room, scene};
use crate::{cells, session};
use glam::{DVec3, UVec3, Vec3};
use lucerna::reference::Channel;
use lucerna::scene::{Material, Scene};
use lucerna::voxel::Resolution;
use lucerna::voxel_cone::{PyramidStorage, VoxelConeSettings};
use lucerna::voxel_rt::Bounces;

const EMISSION: [f32; 3] = [0.7, 1.0, 0.25];

fn furnace(albedo: f32) -> Scene {
    let material = Material { emission: EMISSION.into(), ..lambert([albedo; 3]) };
    scene(room([2.0, 1.0, 3.0], 0), vec![material])
}

/// Indirect light relative to L_e·Σ ρᵏ, k from 2 on (to `n` if bounces are counted): the mean, and the
/// least and the most of a pixel.
fn found(albedo: f32, n_frames: u32, settings: VoxelConeSettings) -> [f64; 3] {
    let world = upload(&furnace(albedo));
    let mut session = session(&world, &camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4]), settings);
    session.run(&world, n_frames);
    let rho = f64::from(albedo);
    let sum = match settings.bounces {
        Bounces::UpTo(n) => (2..=n as i32 + 1).map(|k| rho.powi(k)).sum(),
        Bounces::Unlimited => rho * rho / (1.0 - rho),
    };
    let expected = Vec3::from(EMISSION).as_dvec3() * sum;
    let picture = session.picture(&world, 16, Channel::Indirect);
    let shares: Vec<DVec3> = picture.iter().map(|pixel| pixel.as_dvec3() / expected).collect();
    let mean = shares.iter().sum::<DVec3>() / shares.len() as f64;
    let least = shares.iter().map(|share| share.min_element()).fold(f64::MAX, f64::min);
    let most = shares.iter().map(|share| share.max_element()).fold(0.0, f64::max);
    eprintln!("albedo {albedo}, {settings:?}: {mean}, pixels {least} to {most}");
    [mean.y, least, most]
}

/// Cones mix what they pass with weights that sum to 1 or less, so nothing can come out too bright but what the direct light's
/// noise makes so; too dark it comes out where cones slip through an edge of the box. Within 5 % on average and 25 % anywhere.
fn converges(albedo: f32, n_frames: u32, settings: VoxelConeSettings) {
    let [mean, least, most] = found(albedo, n_frames, settings);
    assert!((0.95..1.03).contains(&mean), "{mean}");
    assert!(least > 0.75 && most < 1.1, "{least} to {most}");
}

#[test]
fn furnace_converges() {
    converges(0.5, 32, cells(32));
}

#[test]
fn furnace_in_buffers_converges() {
    converges(0.5, 32, VoxelConeSettings { storage: PyramidStorage::Buffers, ..cells(24) });
}

#[test]
fn furnace_of_three_levels_converges() {
    converges(0.5, 32, VoxelConeSettings { n_levels: 3, ..cells(32) });
}

/// A box of cells that is no power of two along any axis.
#[test]
fn furnace_in_a_grid_of_odd_sizes_converges() {
    let resolution = Resolution::Size(UVec3::new(27, 19, 37));
    converges(0.5, 32, VoxelConeSettings { resolution, ..cells(1) });
}

/// At albedo 0.95 light is reflected some twenty times; each share that a bounce loses counts as often. It stays bounded: what
/// it converges to is not above the truth, and nothing moves any more.
#[test]
fn furnace_of_albedo_95_is_stable() {
    let settings = VoxelConeSettings { bounce_period: 1, ..cells(24) };
    let [half, _, _] = found(0.95, 80, settings);
    let [whole, _, most] = found(0.95, 160, settings);
    assert!((0.6..1.03).contains(&whole) && most < 1.1, "{whole}, {most}");
    assert!((whole / half - 1.0).abs() < 0.03, "{half} and later {whole}");
}

/// Of n bounces exactly the light of n: each adds its share of the geometric sum.
#[test]
fn bounces_are_counted() {
    for n in [1, 2, 3] {
        let settings = VoxelConeSettings { bounces: Bounces::UpTo(n), ..cells(24) };
        let [mean, least, most] = found(0.8, 24, settings);
        assert!((0.92..1.03).contains(&mean), "{n}: {mean}");
        assert!(least > 0.7 && most < 1.1, "{n}: {least} to {most}");
    }
}
