// SPDX-License-Identifier: MIT OR Apache-2.0
//! Point, spot and directional lights over a plane: L = ρ/π · I·cosθ/d² at every pixel.

use crate::harness::assert_each;
use crate::support::{batches, diffuse, floor, lambert, look_down, over_pixels, scene, settings};
use glam::{DVec2, DVec3, Vec3};
use lucerna::scene::Light;
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings};
use std::f64::consts::{FRAC_PI_2, PI};

const ALBEDO: [f32; 3] = [0.8, 0.5, 0.2];
/// Half the side of what the camera sees [m].
const HALF: f32 = 2.0;

/// Irradiance of a light on the plane y = 0, by KHR_lights_punctual.
fn irradiance(light: &Light, at: DVec3) -> DVec3 {
    let window = |distance: f64, range: Option<f32>| {
        range.map_or(1.0, |r| (1.0 - (distance / f64::from(r)).powi(4)).clamp(0.0, 1.0))
    };
    match light {
        Light::Point { position, intensity, range } => {
            let to_light = position.as_dvec3() - at;
            let d = to_light.length();
            intensity.as_dvec3() * (to_light.y / d / (d * d) * window(d, *range))
        }
        Light::Spot { position, direction, intensity, inner, outer, range } => {
            let to_light = position.as_dvec3() - at;
            let d = to_light.length();
            let cosine = -direction.as_dvec3().dot(to_light / d);
            let (inner, outer) = (f64::from(*inner).cos(), f64::from(*outer).cos());
            let share = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
            intensity.as_dvec3() * (share * to_light.y / d / (d * d) * window(d, *range))
        }
        Light::Directional { direction, irradiance } => {
            irradiance.as_dvec3() * f64::from(-direction.y)
        }
    }
}

/// Beauty, direct and irradiance; there is nothing else to see.
fn check(what: &str, lights: &[Light], n_samples: u32) {
    let mut world = scene(vec![floor(10.0, 0.0, 0)], vec![lambert(ALBEDO)]);
    world.lights = lights.to_vec();
    let world = diffuse(&world);
    let settings = settings(16, 16, 2);
    let camera = look_down(1.0, HALF);
    let truth = over_pixels(settings.size, |DVec2 { x, y }| {
        let at = DVec3::new(x, 0.0, y) * f64::from(HALF);
        lights.iter().map(|light| irradiance(light, at)).sum::<DVec3>()
    });
    let reflected: Vec<_> = truth.iter().map(|&e| e * Vec3::from(ALBEDO).as_dvec3() / PI).collect();
    let found = batches(&world, &camera, &settings, n_samples);
    found.estimate(Channel::Beauty).check(what, &reflected, 0.005);
    found.estimate(Channel::Direct).check(what, &reflected, 0.005);
    for dark in [Channel::Emitted, Channel::Indirect] {
        assert_each(
            &format!("{what}: {dark:?} of pixels"),
            &found.estimate(dark).pixels,
            "0",
            |&pixel| pixel == DVec3::ZERO,
        );
    }
    let settings = settings!(ReferenceSettings { irradiance: true, ..settings });
    let found = batches(&world, &camera, &settings, n_samples);
    found.estimate(Channel::Irradiance).check(&format!("{what}, irradiance"), &truth, 0.005);
}

const POINT: Light = Light::Point {
    position: Vec3::new(0.4, 0.7, -0.3),
    intensity: Vec3::new(3.0, 2.0, 1.0),
    range: None,
};

fn spot(inner: f64, outer: f64, range: Option<f32>) -> Light {
    Light::Spot {
        position: Vec3::new(-0.5, 1.5, 0.4),
        direction: Vec3::new(0.3, -1.0, 0.1).normalize(),
        intensity: Vec3::new(1.0, 2.0, 4.0),
        inner: inner as f32,
        outer: outer as f32,
        range,
    }
}

const SUN: Light = Light::Directional {
    // Unit length: 0.48² + 0.8² + 0.36².
    direction: Vec3::new(0.48, -0.8, 0.36),
    irradiance: Vec3::new(10.0, 5.0, 1.0),
};

#[test]
fn point_light_over_a_plane() {
    check("point", &[POINT], 512);
}

#[test]
fn point_light_with_a_range() {
    let Light::Point { position, intensity, .. } = POINT else { unreachable!() };
    check("range 1.5 m", &[Light::Point { position, intensity, range: Some(1.5) }], 1024);
}

/// Both edges of the cone fall into the picture.
#[test]
fn spot_lights_over_a_plane() {
    check("spot", &[spot(0.3, 0.6, None)], 1024);
    check("hard spot", &[spot(0.5, 0.55, Some(4.0))], 2048);
    check("widest spot", &[spot(0.0, FRAC_PI_2, None)], 1024);
}

#[test]
fn directional_light_over_a_plane() {
    check("directional", &[SUN], 64);
}

/// Below the horizon nothing arrives.
#[test]
fn light_from_below_the_plane_does_not_arrive() {
    let mut world = scene(vec![floor(10.0, 0.0, 0)], vec![lambert(ALBEDO)]);
    world.lights = vec![
        Light::Directional { direction: Vec3::Y, irradiance: Vec3::ONE },
        Light::Point { position: Vec3::NEG_Y, intensity: Vec3::ONE, range: None },
    ];
    let found = batches(&diffuse(&world), &look_down(1.0, HALF), &settings(8, 8, 2), 64);
    assert_each(
        "beauty of pixels lit from below",
        &found.estimate(Channel::Beauty).pixels,
        "black",
        |&pixel| pixel == DVec3::ZERO,
    );
}

/// One is drawn at a time, with what probability ever.
#[test]
fn several_lights_add_up() {
    let strong = Light::Point {
        position: Vec3::new(-1.0, 2.0, 1.0),
        intensity: Vec3::new(20.0, 1.0, 30.0),
        range: None,
    };
    check("four lights", &[POINT, spot(0.3, 0.6, None), SUN, strong], 8192);
}
