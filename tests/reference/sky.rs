// SPDX-License-Identifier: MIT OR Apache-2.0
//! Skies over a plane, and seen directly.

use crate::support::{
    batches, diffuse, floor, lambert, look_down, over_pixels, render, scene, settings,
};
use glam::{DVec3, Vec3};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Projection, Sky};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use std::f64::consts::{PI, TAU};

const ALBEDO: [f32; 3] = [0.9, 0.5, 0.1];

fn under(sky: Sky) -> GpuScene {
    let mut world = scene(vec![floor(1000.0, 0.0, 0)], vec![lambert(ALBEDO)]);
    world.sky = sky;
    diffuse(&world)
}

/// The plane sees E everywhere: L = ρ/π · E.
fn check_plane(what: &str, sky: Sky, irradiance: DVec3, n_samples: u32) {
    let world = under(sky);
    let (camera, settings) = (look_down(1.0, 2.0), settings(16, 16, 2));
    let reflected = irradiance * Vec3::from(ALBEDO).as_dvec3() / PI;
    let found = batches(&world, &camera, &settings, n_samples);
    found.estimate(Channel::Beauty).check_all(what, reflected, 0.005);
    found.estimate(Channel::Direct).check_all(what, reflected, 0.005);
    assert_eq!(found.estimate(Channel::Emitted).mean, DVec3::ZERO, "{what}: mean emitted light");
    assert_eq!(found.estimate(Channel::Indirect).mean, DVec3::ZERO, "{what}: mean indirect light");
    let settings = settings!(ReferenceSettings { irradiance: true, ..settings });
    let found = batches(&world, &camera, &settings, n_samples);
    found.estimate(Channel::Irradiance).check_all(&format!("{what}, E"), irradiance, 0.005);
}

#[test]
fn constant_sky_over_a_plane() {
    let radiance = Vec3::new(1.0, 2.0, 0.5);
    check_plane("constant sky", Sky::Constant(radiance), PI * radiance.as_dvec3(), 2048);
}

#[test]
fn constant_image_sky_over_a_plane() {
    let radiance = Vec3::new(1.0, 2.0, 0.5);
    let sky = Sky::Image { width: 9, height: 5, rgb: vec![radiance; 45] };
    check_plane("constant image", sky, PI * radiance.as_dvec3(), 2048);
}

const WIDTH: u32 = 16;
const HEIGHT: u32 = 8;

/// Dim, tinted by direction, black in places, with one texel 40 times as bright.
fn patch() -> Vec<Vec3> {
    (0..HEIGHT)
        .flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
        .map(|(x, y)| match (x, y) {
            (5, 2) => Vec3::new(40.0, 30.0, 10.0),
            (9..=11, _) => Vec3::ZERO,
            _ => Vec3::new(x as f32 / 16.0, 0.5, y as f32 / 8.0),
        })
        .collect()
}

/// Bilinear between texel centres, around in u, held at the poles. u = 0 is −Z, 0.25 +X.
fn oracle(rgb: &[Vec3], direction: DVec3) -> DVec3 {
    let u = (direction.x.atan2(-direction.z) / TAU).rem_euclid(1.0);
    let v = direction.y.clamp(-1.0, 1.0).acos() / PI;
    let (x, y) = (u * f64::from(WIDTH) - 0.5, v * f64::from(HEIGHT) - 0.5);
    let texel = |x: f64, y: f64| {
        let x = (x as i64).rem_euclid(i64::from(WIDTH));
        let y = (y as i64).clamp(0, i64::from(HEIGHT) - 1);
        rgb[(y * i64::from(WIDTH) + x) as usize].as_dvec3()
    };
    let (left, top) = (x.floor(), y.floor());
    let upper = texel(left, top).lerp(texel(left + 1.0, top), x - left);
    upper.lerp(texel(left, top + 1.0).lerp(texel(left + 1.0, top + 1.0), x - left), y - top)
}

/// E = ∫ L cosθ dω by the midpoint rule over 1024 × 512 directions of the upper half: the error
/// goes with the square of the step, about 1e-5.
#[test]
fn image_sky_with_a_bright_patch_over_a_plane() {
    let rgb = patch();
    let (n_phi, n_theta) = (1024, 512);
    let mut irradiance = DVec3::ZERO;
    for i in 0..n_theta {
        let theta = 0.5 * PI * (f64::from(i) + 0.5) / f64::from(n_theta);
        for k in 0..n_phi {
            let phi = TAU * (f64::from(k) + 0.5) / f64::from(n_phi);
            let direction =
                DVec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            irradiance += oracle(&rgb, direction) * theta.cos() * theta.sin();
        }
    }
    irradiance *= 0.5 * PI / f64::from(n_theta) * TAU / f64::from(n_phi);
    let sky = Sky::Image { width: WIDTH, height: HEIGHT, rgb };
    check_plane("bright patch", sky, irradiance, 8192);
}

/// Looks in six directions: the mapping of the sky, and that a sky is seen unchanged.
#[test]
fn image_sky_seen_directly() {
    let rgb = patch();
    let world = under(Sky::Image { width: WIDTH, height: HEIGHT, rgb: rgb.clone() });
    for forward in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z, Vec3::Y, Vec3::new(0.6, 0.8, 0.0)] {
        let right = forward.cross(if forward == Vec3::Y { Vec3::X } else { Vec3::Y }).normalize();
        let camera = Camera {
            name: String::new(),
            position: Vec3::Y,
            forward,
            up: right.cross(forward),
            projection: Projection::Perspective { vertical_fov: 1.0 },
        };
        let settings = settings(16, 16, 0);
        let tangent = 0.5f64.tan();
        let (right, up) = (right.as_dvec3(), camera.up.as_dvec3());
        let direction =
            |x: f64, y: f64| (forward.as_dvec3() + tangent * (x * right - y * up)).normalize();
        let truth = over_pixels(settings.size, |p| oracle(&rgb, direction(p.x, p.y)));
        let found = batches(&world, &camera, &settings, 512).estimate(Channel::Emitted);
        // Where the picture ends below the horizon there is the floor, which emits nothing.
        let size = settings.size;
        let horizon = over_pixels(size, |p| DVec3::splat((direction(p.x, p.y).y > 0.0).into()));
        let sums = render(&world, &camera, &settings, 1);
        let surfaces = resolve(&sums, size, Channel::Albedo);
        for (ix, share) in horizon.iter().enumerate() {
            let (expected, noise) = (truth[ix] * share.x, found.pixel_errors[ix]);
            if share.x == 1.0 {
                let off = (found.pixels[ix] - expected).abs() - 6.0 * noise;
                // The horizon is 1000 m away: a pixel that touches it is not among these.
                assert!(
                    off.max_element() < 1e-4,
                    "looking to {forward}: emitted light of pixel {ix} is {}, expected {expected} within 6 · {noise} and 1e-4",
                    found.pixels[ix]
                );
                assert_eq!(
                    surfaces.rgb[ix],
                    Vec3::ZERO,
                    "looking to {forward}: albedo of pixel {ix}, which sees the sky alone"
                );
            } else if share.x == 0.0 && p_below(ix, &direction) {
                assert_eq!(
                    found.pixels[ix],
                    DVec3::ZERO,
                    "looking to {forward}: emitted light of pixel {ix}, which sees the floor alone"
                );
            }
        }
    }
}

/// Without a floor: the whole sphere of an image sky, its poles included, is the image's. Six faces of a cube, each pixel
/// the mean of the oracle over it; 6 standard errors.
#[test]
fn image_sky_is_seen_to_both_poles() {
    let rgb = patch();
    let mut world = scene(vec![floor(0.001, -1000.0, 0)], vec![lambert(ALBEDO)]);
    world.sky = Sky::Image { width: WIDTH, height: HEIGHT, rgb: rgb.clone() };
    let world = diffuse(&world);
    for forward in [Vec3::Y, Vec3::NEG_Y, Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let right = forward.cross(if forward.y != 0.0 { Vec3::X } else { Vec3::Y }).normalize();
        let camera = Camera {
            name: String::new(),
            position: Vec3::Y,
            forward,
            up: right.cross(forward),
            projection: Projection::Perspective { vertical_fov: std::f32::consts::FRAC_PI_2 },
        };
        let settings = settings(15, 15, 0);
        let (ahead, right, up) = (forward.as_dvec3(), right.as_dvec3(), camera.up.as_dvec3());
        let truth = over_pixels(settings.size, |p| {
            oracle(&rgb, (ahead + p.x * right - p.y * up).normalize())
        });
        let found = batches(&world, &camera, &settings, 512).estimate(Channel::Emitted);
        for (ix, &expected) in truth.iter().enumerate() {
            let off = (found.pixels[ix] - expected).abs() - 6.0 * found.pixel_errors[ix];
            let pixel = found.pixels[ix];
            assert!(
                off.max_element() < 1e-3,
                "looking to {forward}: emitted light of pixel {ix} is {pixel}, expected {expected} within 6 · {} and 1e-3",
                found.pixel_errors[ix]
            );
        }
    }
}

/// Whether a pixel lies wholly more than 0.5° below the horizon (the floor ends at 1000 m).
fn p_below(ix: usize, direction: &impl Fn(f64, f64) -> DVec3) -> bool {
    let (x, y) = ((ix % 16) as f64, (ix / 16) as f64);
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)];
    corners.iter().all(|(dx, dy)| direction((x + dx) / 8.0 - 1.0, (y + dy) / 8.0 - 1.0).y < -0.009)
}
