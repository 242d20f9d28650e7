// SPDX-License-Identifier: MIT OR Apache-2.0
//! A sky that changes after the bake: light of its parts, weighted, against a bake of the sky itself.

use crate::bake::bake;
use crate::cells;
use crate::harness::{gpu, read, submit};
use crate::session::upload;
use crate::support::{lambert, room, scene};
use glam::{DVec3, Vec3};
use lucerna::components::probes::{ProbeBake, ProbeBasis, ProbeSettings, Probes};
use lucerna::scene::{Light, N_SKY_PARTS, Scene, Sky, sky_part, sky_part_weights};
use lucerna::settings;

/// A room without a ceiling, of two colours, with a lamp.
fn open_room(sky: Sky, with_lamp: bool) -> Scene {
    let mut walls = room([2.0, 1.0, 3.0], 0);
    walls.retain(|wall| !wall.positions.iter().all(|p| p.y == 1.0));
    walls[1].material = 1;
    let mut out = scene(walls, vec![lambert([0.7, 0.5, 0.4]), lambert([0.2, 0.4, 0.7])]);
    out.sky = sky;
    if with_lamp {
        out.lights.push(Light::Point {
            position: Vec3::new(1.5, 0.7, 0.5),
            intensity: Vec3::new(0.2, 0.3, 0.1),
            range: None,
        });
    }
    out
}

fn chosen() -> ProbeSettings {
    settings!(ProbeSettings { n_paths: 1024, n_bounces: 4, ..cells(10) })
}

/// An equirectangular picture of 64 × 32 texels of a function of the direction.
fn picture(of: impl Fn(Vec3) -> Vec3) -> Sky {
    let (width, height) = (64u32, 32u32);
    let texel = |ix: u32| {
        let [u, v] =
            [(ix % width, width), (ix / width, height)].map(|(k, n)| (k as f32 + 0.5) / n as f32);
        let (theta, phi) = (std::f32::consts::PI * v, std::f32::consts::TAU * u);
        of(Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos()))
    };
    Sky::Image { width, height, rgb: (0..width * height).map(texel).collect() }
}

/// The packed light of bakes with these weights.
fn blended(bakes: &[&ProbeBake], weights: &[Vec3]) -> Vec<[f32; 27]> {
    let world = upload(&open_room(Sky::default(), false));
    let settings = settings!(ProbeSettings { basis: ProbeBasis::Sh2Float });
    let mut probes = Probes::from_bakes(gpu(), &world, settings, bakes).unwrap();
    probes.set_colours(weights);
    submit(|recorder| probes.update(recorder, &world)).unwrap();
    let light = read(probes.light());
    bytemuck::pod_collect_to_vec(&light[..108 * bakes[0].probes.len()])
}

/// How far some probes' light is from others': the root mean square over all coefficients, by that of the others.
fn apart(found: &[[f32; 27]], expected: &[[f32; 27]]) -> f64 {
    let sum = |of: &mut dyn Iterator<Item = f64>| of.map(|x| x * x).sum::<f64>();
    let pairs = found.as_flattened().iter().zip(expected.as_flattened());
    let off = sum(&mut pairs.map(|(a, b)| f64::from(*a) - f64::from(*b)));
    (off / sum(&mut expected.as_flattened().iter().map(|b| f64::from(*b)))).sqrt()
}

/// Light that was baked for the parts of a sky, and for the lamp alone, is that of any sky of order 2 with the lamp: within 4 % (root mean square over all
/// coefficients) of a bake of that sky. Both have the noise of 1024 paths: two bakes of the same sky with other seeds are about as far apart. A constant sky needs one
/// part, a sky with a sun of 20° has more detail than order 2, which is told, and errs by less than half of what is told: walls blur it.
#[test]
fn a_sky_can_change_after_the_bake() {
    let lamp = bake(&open_room(Sky::default(), true), chosen());
    let parts: Vec<ProbeBake> =
        (0..N_SKY_PARTS).map(|ix| bake(&open_room(sky_part(ix), false), chosen())).collect();
    let all: Vec<&ProbeBake> = std::iter::once(&lamp).chain(&parts).collect();
    let of_sky = |sky: &Sky, seed: u32| {
        let own = settings!(ProbeSettings { seed, ..chosen() });
        let whole = bake(&open_room(sky.clone(), true), own);
        blended(&[&whole], &[Vec3::ONE])
    };
    let by_parts = |sky: &Sky| {
        let (weights, lost) = sky_part_weights(sky);
        (blended(&all, &[&[Vec3::ONE], weights.as_slice()].concat()), lost)
    };
    let constant = Sky::Constant(Vec3::new(0.3, 0.5, 0.9));
    let evening = picture(|d| {
        Vec3::new(1.0, 0.7, 0.5)
            + Vec3::new(0.3, 0.4, 0.8) * d.y
            + Vec3::new(0.5, 0.2, 0.0) * d.x
            + Vec3::splat(0.2) * d.x * d.z
    });
    let morning = picture(|d| Vec3::new(0.4, 0.5, 0.8) - Vec3::new(0.3, 0.2, 0.1) * d.x);
    for (name, sky) in [("constant", &constant), ("evening", &evening), ("morning", &morning)] {
        let (found, lost) = by_parts(sky);
        assert!(lost < 0.02, "{name}: {lost} of the sky is lost");
        let expected = of_sky(sky, 0);
        let (off, noise) = (apart(&found, &expected), apart(&of_sky(sky, 1), &expected));
        println!("{name}: {off}, with another seed {noise}");
        assert!(off < 0.04, "{name}: {off} of the light is off (noise: {noise})");
    }
    let difference = apart(&by_parts(&evening).0, &by_parts(&morning).0);
    assert!(difference > 0.2, "evening and morning differ by {difference}");
    let sun = picture(|d| {
        let is_sun = d.dot(Vec3::new(0.4, 0.8, 0.45).normalize()) > 0.94;
        if is_sun { Vec3::new(8.0, 7.0, 5.0) } else { Vec3::new(0.2, 0.3, 0.5) }
    });
    let (found, lost) = by_parts(&sun);
    let off = apart(&found, &of_sky(&sun, 0));
    println!("sun: {off}, {lost} of the sky is lost");
    assert!(
        lost > 0.5 && off < 0.5 * f64::from(lost),
        "a sun: {off} of the light is off, {lost} lost"
    );
}

/// Weights count for each colour, and may be below 0: a bake less itself is nothing.
#[test]
fn colours_are_weighted_apart() {
    let lit =
        bake(&open_room(sky_part(0), true), settings!(ProbeSettings { n_paths: 64, ..chosen() }));
    let own = blended(&[&lit], &[Vec3::ONE]);
    let weights = Vec3::new(0.5, 0.0, 2.0);
    let found = blended(&[&lit], &[weights]);
    for (found, own) in found.as_flattened().chunks(3).zip(own.as_flattened().chunks(3)) {
        let expected = Vec3::from_slice(own).as_dvec3() * weights.as_dvec3();
        let off = (Vec3::from_slice(found).as_dvec3() - expected).abs();
        assert!(
            off.cmple(DVec3::splat(1e-6) * expected.abs() + 1e-12).all(),
            "{found:?}, expected {expected}"
        );
    }
    let nothing = blended(&[&lit, &lit], &[Vec3::ONE, Vec3::NEG_ONE]);
    let largest = own.as_flattened().iter().fold(0.0f32, |a, b| a.max(b.abs()));
    assert!(nothing.as_flattened().iter().all(|x| x.abs() < 1e-6 * largest));
}
