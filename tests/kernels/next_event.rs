// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/light/next_event.wgsl`, and what it weighs with.

use crate::harness::{Largest, Random, map};
use glam::{DVec3, Vec3, Vec4};
use std::f64::consts::PI;

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Draw {
    to_light: Vec3,
    pdf: f32,
    sent: Vec3,
    n_light: f32,
    shading_normal: Vec3,
    n_scattered: f32,
    geometric_normal: Vec3,
    albedo: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
struct Found {
    reflected: Vec3,
    reflected_weight: f32,
    irradiance: Vec3,
    irradiance_weight: f32,
    may_arrive: [u32; 4],
}

fn find(draws: &[Draw]) -> Vec<Found> {
    map(
        "#import lucerna::light::next_event::{irradiance_of_light, reflected_of_light}
         #import lucerna::bsdf::scattering::Scattering
         #import lucerna::bsdf::metallic_roughness::metallic_roughness
         #import lucerna::math::frame::frame_from_normal
         struct Input {
             to_light: vec3<f32>, pdf: f32, sent: vec3<f32>, n_light: f32,
             shading_normal: vec3<f32>, n_scattered: f32, geometric_normal: vec3<f32>, albedo: f32,
         }
         struct Output {
             reflected: vec3<f32>, reflected_weight: f32, irradiance: vec3<f32>, irradiance_weight: f32,
             may_arrive: vec4<u32>,
         }
         fn map(x: Input) -> Output {
             let frame = frame_from_normal(x.shading_normal);
             let lambert = Scattering(metallic_roughness(vec3<f32>(x.albedo), 0.0, 1.0), true, vec3<f32>(0.0, 0.0, 1.0));
             let a = reflected_of_light(
                 x.to_light, x.sent, x.pdf, x.geometric_normal, lambert, frame, x.n_light, x.n_scattered,
             );
             let b = irradiance_of_light(x.to_light, x.sent, x.pdf, x.shading_normal, x.geometric_normal);
             let may = vec4<u32>(u32(a.may_arrive), u32(b.may_arrive), 0u, 0u);
             return Output(a.light, a.weight, b.light, b.weight, may);
         }",
        draws,
    )
}

/// Lambert's ρ/π·cos and the power heuristic, in f64. Cosines are good to 2e-7 (the frame's columns are), so results are good to that and
/// some roundings of themselves; lights along the horizon of either normal, to 1e-6, may fall to either side.
#[test]
fn light_and_its_weight_match_f64() {
    let mut random = Random(41);
    let draws: Vec<Draw> = (0..20_000)
        .map(|ix| {
            let shading_normal = random.direction();
            let lean = shading_normal + 0.5 * random.direction();
            Draw {
                to_light: random.direction(),
                pdf: if ix % 4 == 0 { 0.0 } else { 10f32.powf(random.range(-3.0, 4.0)) },
                sent: Vec3::new(random.range(0.0, 9.0), random.range(0.0, 9.0), (ix % 3) as f32),
                n_light: (1 + ix % 4) as f32,
                shading_normal,
                n_scattered: (ix % 3) as f32,
                geometric_normal: lean.as_dvec3().normalize().as_vec3(),
                albedo: random.unit(),
            }
        })
        .collect();
    for (draw, found) in draws.iter().zip(find(&draws)) {
        let cosine = draw.to_light.as_dvec3().dot(draw.shading_normal.as_dvec3());
        let rise = draw.to_light.as_dvec3().dot(draw.geometric_normal.as_dvec3());
        if cosine.abs() < 1e-6 || rise.abs() < 1e-6 {
            continue;
        }
        let arrives = cosine > 0.0 && rise > 0.0;
        let expected_arrives = u32::from(arrives);
        assert_eq!(
            found.may_arrive[1], expected_arrives,
            "{draw:?}: whether irradiance may arrive"
        );
        assert_eq!(
            found.may_arrive[0],
            u32::from(arrives && draw.albedo > 0.0),
            "{draw:?}: whether reflected light may arrive"
        );
        if !arrives {
            assert_eq!(
                (found.reflected, found.irradiance),
                (Vec3::ZERO, Vec3::ZERO),
                "{draw:?}: reflected light and irradiance of a light that does not arrive"
            );
            continue;
        }
        let irradiance = draw.sent.as_dvec3() * cosine;
        let reflected = irradiance * f64::from(draw.albedo) / PI;
        let near =
            |a: Vec3, b: DVec3| (a.as_dvec3() - b).largest() <= 1e-6 * b.max_element() / cosine;
        assert!(
            near(found.irradiance, irradiance),
            "{draw:?}: irradiance is {}, expected {irradiance} within {:.1e} of its largest",
            found.irradiance,
            1e-6 / cosine
        );
        assert!(
            near(found.reflected, reflected),
            "{draw:?}: reflected light is {}, expected {reflected} within {:.1e} of its largest",
            found.reflected,
            1e-6 / cosine
        );
        let weight = |n_light: f64, n_scattered: f64| {
            let light = f64::from(draw.pdf) * n_light;
            let other = cosine / PI * n_scattered;
            if light == 0.0 { 1.0 } else { light * light / (light * light + other * other) }
        };
        let weights = [
            ("irradiance", found.irradiance_weight, weight(1.0, 1.0)),
            (
                "reflected light",
                found.reflected_weight,
                weight(draw.n_light.into(), draw.n_scattered.into()),
            ),
        ];
        for (what, found, expected) in weights {
            assert!(
                (f64::from(found) - expected).abs() < 2e-6 / cosine.max(0.01),
                "{draw:?}: the weight of {what} is {found}, expected {expected} within {:.1e}",
                2e-6 / cosine.max(0.01)
            );
        }
    }
}

/// A light that is not finite stays so where it cannot arrive, so that who adds it up can count it; a dark one needs no shadow ray.
#[test]
fn dark_lights_need_no_shadow_and_broken_ones_stay_broken() {
    let draw = Draw {
        to_light: Vec3::Y,
        pdf: 1.0,
        sent: Vec3::ZERO,
        n_light: 1.0,
        shading_normal: Vec3::Y,
        n_scattered: 1.0,
        geometric_normal: Vec3::Y,
        albedo: 1.0,
    };
    let nan = Draw { sent: Vec3::splat(f32::NAN), ..draw };
    let below = Draw { sent: Vec3::splat(f32::INFINITY), geometric_normal: Vec3::NEG_Y, ..draw };
    let finite_below = Draw { sent: Vec3::ONE, geometric_normal: Vec3::NEG_Y, ..draw };
    let found = find(&[draw, nan, below, finite_below]);
    let cases = ["dark", "NaN", "infinite from below", "finite from below"];
    for (ix, found) in found.iter().enumerate() {
        let what = cases[ix];
        assert_eq!(
            found.may_arrive, [0; 4],
            "{what}: whether reflected light and irradiance may arrive"
        );
        assert_eq!(found.reflected, Vec3::ZERO, "{what}: reflected light");
        let is_finite = found.irradiance.is_finite();
        assert_eq!(
            is_finite,
            ix == 0 || ix == 3,
            "{what}: whether the irradiance {} is finite",
            found.irradiance
        );
        assert!(
            !is_finite || found.irradiance == Vec3::ZERO,
            "{what}: irradiance is {}, expected 0",
            found.irradiance
        );
    }
}

/// What one sample stands for is 1/pdf, nothing where there is no density; a light without extent has the whole weight.
#[test]
fn samples_stand_for_solid_angles() {
    let mut random = Random(42);
    let mut inputs = vec![Vec4::new(0.0, 3.0, 0.0, 0.0), Vec4::new(2.0, 0.0, 0.0, 0.0), Vec4::ZERO];
    inputs.extend((0..1000).map(|_| {
        let mut density = || 10f32.powf(random.range(-6.0, 6.0));
        Vec4::new(density(), density(), 0.0, 0.0)
    }));
    let found: Vec<[f32; 2]> = map(
        "#import lucerna::sampling::mis::{next_event_weight, solid_angle_of_sample}
         alias Input = vec4<f32>;
         struct Output { angle: f32, weight: f32 }
         fn map(x: Input) -> Output { return Output(solid_angle_of_sample(x.x), next_event_weight(x.x, x.y)); }",
        &inputs,
    );
    for (input, [angle, weight]) in inputs.iter().zip(found) {
        let (a, b) = (f64::from(input.x), f64::from(input.y));
        let (expected_angle, expected_weight) =
            if a == 0.0 { (0.0, 1.0) } else { (1.0 / a, a * a / (a * a + b * b)) };
        assert!(
            (f64::from(angle) - expected_angle).abs() <= 3e-7 * expected_angle,
            "pdf {a}: a sample stands for {angle} sr, expected {expected_angle} within 3e-7 of it"
        );
        assert!(
            (f64::from(weight) - expected_weight).abs() < 6e-7,
            "pdfs {a} and {b}: the weight is {weight}, expected {expected_weight} within 6e-7"
        );
    }
}
