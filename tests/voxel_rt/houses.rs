// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rooms with walls at any angle, thin solids and curved shells.

use crate::harness::gpu;
use crate::session::{SIDE, Session, camera, upload};
use glam::{Quat, UVec2, Vec3};
use lucerna::blocking::render_reference;
use lucerna::scene::{Camera, Projection, Scene};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::techniques::voxel_rt::VoxelRtSettings;
use lucerna::testing::{House, room_with_table, vault};

/// Looks from the eye along an axis, 90° wide.
fn looking(position: Vec3, forward: Vec3) -> Camera {
    let up = if forward.y == 0.0 { Vec3::Y } else { Vec3::X };
    let projection = Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 };
    Camera { name: String::new(), position, forward, up, projection }
}

/// The path tracer finds no light at all behind the walls, and some before them.
#[test]
fn houses_are_dark_behind_their_walls() {
    let settings = settings!(ReferenceSettings {
        size: UVec2::splat(12),
        n_bounces: 4,
        ..ReferenceSettings::default()
    });
    for seed in 0..24 {
        let house = House::draw(seed, 8.0 / 64.0);
        let world = upload(&house.scene);
        for (part, eye) in house.eyes.into_iter().enumerate() {
            for forward in Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
                let camera = looking(eye, forward);
                let (sums, _) =
                    render_reference(gpu(), &world, &camera, &settings, 4, |_| true).unwrap();
                let picture = resolve(&sums, settings.size, Channel::Beauty);
                let n_lit = picture.rgb.iter().filter(|&&pixel| pixel != Vec3::ZERO).count();
                assert!(
                    (n_lit > 0) == (part == 0),
                    "house {seed}, {}, towards {forward}: {n_lit} of 144 pixels have light",
                    ["lit part", "dark part"][part]
                );
            }
        }
    }
}

/// Looks straight down (against the axis `up`) on a square of this half side around a point.
fn down_on(at: Vec3, half_height: f32, up: usize) -> Camera {
    let (forward, side) = (-Vec3::AXES[up], Vec3::AXES[(up + 1) % 3]);
    Camera {
        name: String::new(),
        position: at + 0.5 * Vec3::AXES[up],
        forward,
        up: side,
        projection: Projection::Orthographic { half_height },
    }
}

/// Mean indirect light on the table's top, found and by the path tracer.
fn light_on_table(cells: u32, top: f32, thickness: f32, double_sided: bool, up: usize) -> [f64; 2] {
    let scene = room_with_table(top, thickness, double_sided, up);
    let world = upload(&scene);
    // The middle of the table, turned as the room is.
    let at = match up {
        0 => Vec3::new(top, 2.0, 4.0),
        1 => Vec3::new(4.0, top, 2.0),
        _ => Vec3::new(2.0, 4.0, top),
    };
    let camera = down_on(at, 0.7, up);
    let settings = settings!(VoxelRtSettings { resolution: cells, ..Default::default() });
    let mut session = Session::new(&world, &camera, settings);
    session.run(&world, 32);
    let found = session.mean(&world, 16, Channel::Indirect).element_sum();
    let settings = settings!(ReferenceSettings {
        size: UVec2::splat(24),
        n_bounces: 12,
        ..ReferenceSettings::default()
    });
    let (sums, _) = render_reference(gpu(), &world, &camera, &settings, 48, |_| true).unwrap();
    let picture = resolve(&sums, settings.size, Channel::Indirect).rgb;
    let sum: f64 = picture.iter().map(|pixel| f64::from(pixel.element_sum())).sum();
    [found, sum / picture.len() as f64]
}

#[test]
fn thin_tables() {
    let cells: u32 = std::env::var("CELLS").map_or(32, |s| s.parse().unwrap());
    let cell = 8.0 / cells as f32;
    for thickness in [0.2f32, 0.7, 1.3, 2.0] {
        for double_sided in [true, false] {
            let up = 1;
            for step in 0..8 {
                let top = 0.75 + cell * (step as f32 + 0.25) / 8.0;
                let [found, expected] =
                    light_on_table(cells, top, thickness * cell, double_sided, up);
                println!(
                    "{thickness} cells, double-sided {double_sided}, step {step}: {:.3}",
                    found / expected
                );
            }
        }
    }
}

/// Indirect light that a camera sees by the path tracer's: the mean, and the root mean square of how far blocks of 3 × 3
/// pixels are off it.
fn compared(scene: &Scene, camera: &Camera, cells: u32, n_samples: u32) -> [f64; 2] {
    let world = upload(scene);
    let settings = settings!(VoxelRtSettings { resolution: cells, ..Default::default() });
    let mut session = Session::new(&world, camera, settings);
    session.run(&world, 48);
    let found = session.picture(&world, 16, Channel::Indirect);
    let settings = settings!(ReferenceSettings {
        size: UVec2::splat(SIDE),
        n_bounces: 12,
        ..ReferenceSettings::default()
    });
    let (sums, _) =
        render_reference(gpu(), &world, camera, &settings, n_samples, |_| true).unwrap();
    let expected = resolve(&sums, settings.size, Channel::Indirect).rgb;
    let blocks = SIDE as usize / 3;
    let block = |picture: &[Vec3], ix: usize| -> f64 {
        let (x, y) = (ix % blocks * 3, ix / blocks * 3);
        let pixels = (0..9).map(|k| picture[(y + k / 3) * SIDE as usize + x + k % 3]);
        pixels.map(|pixel| f64::from(pixel.element_sum())).sum()
    };
    let ratios: Vec<f64> =
        (0..blocks * blocks).map(|ix| block(&found, ix) / block(&expected, ix)).collect();
    if std::env::var("SHOW").is_ok() {
        for row in 0..SIDE as usize {
            let sum = |p: &[Vec3]| -> f32 { p[row * 24..][..24].iter().map(|x| x.element_sum()).sum() };
            println!("row {row}: {:.3}, {:.4}", sum(&found) / sum(&expected), sum(&expected));
        }
        for row in ratios.chunks(blocks) {
            println!("{:.2?}", row);
        }
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    let square = ratios.iter().map(|ratio| (ratio / mean - 1.0).powi(2)).sum::<f64>();
    [mean, (square / ratios.len() as f64).sqrt()]
}

/// A vault, seen from below.
fn light_under_vault(cells: u32, thickness: f32, turned: Quat) -> [f64; 2] {
    let at = |p: [f32; 3]| (turned * Vec3::from(p)).to_array();
    let camera = Camera {
        projection: Projection::Perspective { vertical_fov: 1.0 },
        ..camera(at([1.5, 0.6, 0.0]), at([-0.5, 2.4, 0.2]))
    };
    compared(&vault(thickness, turned), &camera, cells, 512)
}

#[test]
fn lit_parts() {
    let cells: u32 = std::env::var("CELLS").map_or(64, |s| s.parse().unwrap());
    for seed in std::env::var("SEED").map_or(1..9, |s| { let k: u64 = s.parse().unwrap(); k..k + 1 }) {
        let house = House::draw(seed, 8.0 / cells as f32);
        let eye = house.eyes[0];
        let look = (-house.normal - 0.8 * Vec3::Y).normalize();
        let camera = camera(eye.to_array(), (eye + look).to_array());
        let [mean, bands] = compared(&house.scene, &camera, cells, 256);
        println!(
            "house {seed} ({:.2} cells): mean {mean:.3}, bands {:.1} %",
            house.thickness * cells as f32 / 8.0,
            100.0 * bands
        );
    }
}

#[test]
fn vaults() {
    let cells: u32 = std::env::var("CELLS").map_or(64, |s| s.parse().unwrap());
    let cell = 8.0 / cells as f32;
    for turned in [Quat::IDENTITY, Quat::from_rotation_y(0.6) * Quat::from_rotation_x(0.3)] {
        for thickness in [0.0f32, 0.5, 1.0, 1.6, 3.0] {
            let [mean, bands] = light_under_vault(cells, thickness * cell, turned);
            println!(
                "{thickness} cells, turned {turned}: mean {mean:.3}, bands {:.1} %",
                100.0 * bands
            );
        }
    }
}
