// SPDX-License-Identifier: MIT OR Apache-2.0
//! How probes keep their light, where they move, and how they are blended, against f64.

use crate::harness::{KeepNan, Largest, Random, gpu, read, storage, submit};
use crate::probes::{Placed, gathered, lambert, placed, room, upload, world};
use glam::{DVec3, Mat3, Vec3};
use lucerna::components::probes::{
    COEFFICIENTS, ProbeBasis, ProbeSettings, ProbeVisibility, Probes,
};
use lucerna::gpu::{ComputeKernel, Dispatch, Shaders};
use lucerna::gpu_scene::GpuScene;
use lucerna::library_of;
use lucerna::scene::{Light, Scene};
use lucerna::settings;
use lucerna::shader::{Source, Variant};
use lucerna::testing::Harness;
use std::f64::consts::PI;

/// The nine functions of order 2, in the order l² + l + m, in f64.
fn basis(d: DVec3) -> [f64; 9] {
    let root = |x: f64| (x / PI).sqrt();
    [
        root(1.0 / 4.0),
        root(3.0 / 4.0) * d.y,
        root(3.0 / 4.0) * d.z,
        root(3.0 / 4.0) * d.x,
        root(15.0 / 4.0) * d.x * d.y,
        root(15.0 / 4.0) * d.y * d.z,
        root(5.0 / 16.0) * (3.0 * d.z * d.z - 1.0),
        root(15.0 / 4.0) * d.x * d.z,
        root(15.0 / 16.0) * (d.x * d.x - d.y * d.y),
    ]
}

/// π, 2π/3, π/4: what the cosine makes of the bands (R. Ramamoorthi, P. Hanrahan, 2001).
fn cosine_factor(k: usize) -> f64 {
    [PI, 2.0 * PI / 3.0, PI / 4.0][[0, 1, 1, 1, 2, 2, 2, 2, 2][k]]
}

type Coefficients = [DVec3; 9];

fn irradiance(of: &Coefficients, n_bands: usize, normal: DVec3) -> DVec3 {
    let y = basis(normal);
    (0..n_bands * n_bands).map(|k| of[k] * cosine_factor(k) * y[k]).sum()
}

/// The irradiance of a basis by its definition.
fn expected(basis: ProbeBasis, of: &Coefficients, normal: DVec3) -> DVec3 {
    let chroma = |n_bands: usize| {
        let weighted = |weights: DVec3, n_bands: usize| {
            irradiance(&of.map(|c| DVec3::splat(weights.dot(c))), n_bands, normal).x
        };
        let luma = weighted(DVec3::new(0.25, 0.5, 0.25), 3);
        let orange = weighted(DVec3::new(0.5, 0.0, -0.5), n_bands);
        let green = weighted(DVec3::new(-0.25, 0.5, -0.25), n_bands);
        DVec3::new(luma + orange - green, luma + green, luma - orange - green)
    };
    match basis {
        ProbeBasis::Sh2 | ProbeBasis::Sh2Float | ProbeBasis::Sh2Bytes => irradiance(of, 3, normal),
        ProbeBasis::Sh1 => irradiance(of, 2, normal),
        ProbeBasis::AmbientCube => (0..3)
            .map(|k| {
                let axis = DVec3::AXES[k] * if normal[k] < 0.0 { -1.0 } else { 1.0 };
                irradiance(of, 3, axis) * normal[k] * normal[k]
            })
            .sum(),
        ProbeBasis::ChromaSh1 => chroma(2),
        ProbeBasis::ChromaConstant => chroma(1),
        ProbeBasis::Sh4 => panic!("it has more coefficients: order_four_knows_front_from_back"),
    }
}

/// Light of a few directions, each with a colour: nowhere below 0.
fn light_of(directions: &[(DVec3, DVec3)]) -> Coefficients {
    let mut out = Coefficients::default();
    for (direction, colour) in directions {
        let y = basis(*direction);
        for (c, y) in out.iter_mut().zip(y) {
            *c += y * *colour;
        }
    }
    out
}

const KEEP: &str = "#import lucerna::components::probes::basis::{WORDS, pack_light, unpack_light}
     #import lucerna::components::probes::probe_light::light_irradiance
     struct Input { light: array<vec4<f32>, 9>, normal: vec4<f32> }
     alias Output = vec4<f32>;
     fn map(x: Input) -> Output {
         var own = x.light;
         var light: array<vec3<f32>, 9>;
         for (var k = 0u; k < 9u; k++) {
             light[k] = own[k].xyz;
         }
         return vec4<f32>(light_irradiance(unpack_light(pack_light(light)), x.normal.xyz), f32(WORDS));
     }";

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Keep {
    light: [[f32; 4]; 9],
    normal: [f32; 4],
}

/// Each basis keeps light of any magnitude (1e-18 to 1e18), as its definition in f64 says. Tolerance: halfs are off by 2⁻¹⁰ of
/// the largest number at most, bytes by half a step of 1/127 of the largest that a coefficient can be, each times what the
/// coefficient adds to the irradiance; floats by their roundings.
#[test]
fn bases_keep_light() {
    let mut random = Random(41);
    let n = 1500;
    let cases: Vec<(Coefficients, DVec3)> = (0..n)
        .map(|ix| {
            let magnitude = 10f64.powf((f64::from(random.unit()) * 2.0 - 1.0) * 18.0);
            let n = if ix == 7 { 0 } else { 1 + random.bits() as usize % 4 };
            let mut lobe = || {
                let colour = DVec3::new(
                    random.unit().into(),
                    random.unit().into(),
                    if ix % 5 == 0 { 0.0 } else { random.unit().into() },
                );
                (random.direction().as_dvec3().normalize(), magnitude * colour)
            };
            let lobes: Vec<_> = (0..n).map(|_| lobe()).collect();
            (light_of(&lobes), random.direction().as_dvec3().normalize())
        })
        .collect();
    let inputs: Vec<Keep> = cases.iter().map(|(light, normal)| keep(light, *normal)).collect();
    for kept in ProbeBasis::ALL.into_iter().filter(|kept| *kept != ProbeBasis::Sh4) {
        let library = library_of(kept.of(Variant::BASELINE));
        let harness = Harness::new(gpu().clone()).with_library(library);
        let found: Vec<[f32; 4]> = harness.map(KEEP, &inputs);
        for ((light, normal), found) in cases.iter().zip(found) {
            assert_eq!(found[3], kept.words() as f32, "words of {kept:?}");
            let y = basis(*normal);
            // What an error of 1 in each coefficient can add up to.
            let gain: f64 = (0..9).map(|k| cosine_factor(k) * y[k].abs()).sum();
            let largest = light.iter().map(|c| c.largest()).fold(0.0, f64::max_nan);
            let limit = match kept {
                ProbeBasis::Sh2Float => 1e-6 * gain * largest,
                ProbeBasis::Sh2Bytes => {
                    let most = [1.0, 3f64.sqrt(), 5f64.sqrt()];
                    let band = |k: usize| [0, 1, 1, 1, 2, 2, 2, 2, 2][k];
                    let steps: f64 =
                        (1..9).map(|k| most[band(k)] * cosine_factor(k) * y[k].abs()).sum();
                    light[0].largest() * (steps / 254.0 + 2e-3 * gain)
                }
                // (Three numbers of the cube, or luma and two differences, make one of the irradiance.)
                ProbeBasis::AmbientCube => 1e-3 * 2.0 * PI * largest,
                ProbeBasis::ChromaSh1 | ProbeBasis::ChromaConstant => 3e-3 * gain * largest,
                _ => 1e-3 * gain * largest,
            };
            let found = Vec3::from_slice(&found).as_dvec3();
            let expected = expected(kept, light, *normal);
            assert!(
                (found - expected).largest() <= limit,
                "{kept:?}, normal {normal}: {found}, expected {expected} within {limit}"
            );
        }
    }
}

fn keep(light: &Coefficients, normal: DVec3) -> Keep {
    Keep {
        light: light.map(|c| c.as_vec3().extend(0.0).to_array()),
        normal: normal.as_vec3().extend(0.0).to_array(),
    }
}

/// The fault of fewer hues: red light from one side and cyan from the other, of the same luma, is grey on both sides if only
/// means of hues are kept; with their order 1, each side has its hue.
#[test]
fn mean_hues_are_grey_where_hues_oppose() {
    let luma = |c: DVec3| DVec3::new(0.25, 0.5, 0.25).dot(c);
    let (red, cyan) = (DVec3::X * 4.0, DVec3::new(0.0, 1.0, 1.0) * 4.0 / 3.0);
    assert!((luma(red) - luma(cyan)).abs() < 1e-12);
    let light = light_of(&[(DVec3::X, red), (DVec3::NEG_X, cyan)]);
    let redness = |basis, normal: DVec3| {
        let found: DVec3 = expected(basis, &light, normal);
        (found.x - found.y) / luma(found)
    };
    let of = |kept: ProbeBasis| {
        let inputs = [DVec3::X, DVec3::NEG_X].map(|normal| keep(&light, normal));
        let library = library_of(kept.of(Variant::BASELINE));
        let found: Vec<[f32; 4]> =
            Harness::new(gpu().clone()).with_library(library).map(KEEP, &inputs);
        [0, 1].map(|ix| {
            let [r, g, b, ..] = found[ix].map(f64::from);
            (r - g) / luma(DVec3::new(r, g, b))
        })
    };
    let [front, back] = of(ProbeBasis::Sh2);
    assert!(front > 1.0 && back < -0.3, "order 2: {front}, {back}");
    let [front, back] = of(ProbeBasis::ChromaSh1);
    assert!(front > 1.0 && back < -0.3, "hues of order 1: {front}, {back}");
    let [front, back] = of(ProbeBasis::ChromaConstant);
    let mean = redness(ProbeBasis::ChromaConstant, DVec3::X);
    assert!(
        (front - back).abs() < 1e-2 && (front - mean).abs() < 1e-2,
        "mean hues: {front}, {back}, expected {mean} twice"
    );
}

/// The functions of band 4 are those of the recurrence for all bands.
#[test]
fn band_four_is_that_of_the_recurrence() {
    let mut random = Random(46);
    let inputs: Vec<[f32; 4]> =
        (0..500).map(|_| random.direction().extend(0.0).to_array()).collect();
    let found: Vec<[f32; 20]> = crate::harness::map(
        "#import lucerna::sh::basis::{sh_band_four, sh_basis}
         alias Input = vec4<f32>;
         struct Output { n: array<f32, 20> }
         fn map(x: Input) -> Output {
             var all = sh_basis(x.xyz);
             var own = sh_band_four(x.xyz);
             var out: Output;
             for (var k = 0u; k < 9u; k++) {
                 out.n[k] = own[k];
                 out.n[9u + k] = all[16u + k];
             }
             return out;
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(&found) {
        for k in 0..9 {
            // (Of sh_basis: 1e-6 of √(9/4π).)
            let off = (found[k] - found[9 + k]).abs();
            assert!(off < 3e-6, "{input:?}, function {k}: {} and {}", found[k], found[9 + k]);
        }
    }
}

/// Light from one direction, kept to order 4: the irradiance is Σ A(l) (2l + 1)/4π P(l, cos θ) over l = 0, 1, 2, 4, by the addition theorem. Straight behind,
/// that is −1/32 of the flux, where order 2 has 1/16. Tolerance: halfs, as in `bases_keep_light`.
#[test]
fn order_four_knows_front_from_back() {
    let mut random = Random(47);
    let text = "#import lucerna::components::probes::basis::{pack_light, unpack_light}
         #import lucerna::components::probes::probe_light::light_irradiance
         #import lucerna::sh::basis::{sh2_basis, sh_band_four}
         struct Input { direction: vec4<f32>, normal: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             var low = sh2_basis(x.direction.xyz);
             var high = sh_band_four(x.direction.xyz);
             var light: array<vec3<f32>, 18>;
             for (var k = 0u; k < 9u; k++) {
                 light[k] = vec3<f32>(1.0, 2.0, 3.0) * low[k];
                 light[9u + k] = vec3<f32>(1.0, 2.0, 3.0) * high[k];
             }
             return vec4<f32>(light_irradiance(unpack_light(pack_light(light)), x.normal.xyz), 0.0);
         }";
    let mut inputs: Vec<[[f32; 4]; 2]> =
        (0..500).map(|_| [(); 2].map(|()| random.direction().extend(0.0).to_array())).collect();
    inputs.push([[0.0, 0.6, 0.8, 0.0], [0.0, -0.6, -0.8, 0.0]]);
    let library = library_of(ProbeBasis::Sh4.of(Variant::BASELINE));
    let found: Vec<[f32; 4]> = Harness::new(gpu().clone()).with_library(library).map(text, &inputs);
    for ([direction, normal], found) in inputs.iter().zip(&found) {
        let x = Vec3::from_slice(direction).as_dvec3().dot(Vec3::from_slice(normal).as_dvec3());
        let legendre = [
            (PI, 1.0, 1.0),
            (2.0 * PI / 3.0, 3.0, x),
            (PI / 4.0, 5.0, 1.5 * x * x - 0.5),
            (-PI / 24.0, 9.0, (35.0 * x.powi(4) - 30.0 * x * x + 3.0) / 8.0),
        ];
        let expected: f64 = legendre.iter().map(|(a, n, p)| a * n / (4.0 * PI) * p).sum();
        for k in 0..3 {
            let off = f64::from(found[k]) - (k + 1) as f64 * expected;
            assert!(off.abs() < 1e-2, "cosine {x}: {found:?}, expected {expected}");
        }
    }
    let behind = f64::from(found[500][0]);
    assert!((behind + 1.0 / 32.0).abs() < 3e-3, "straight behind: {behind}");
}

/// What probes gather of band 4 beside a lit sheet: the integrals of its functions over the sheet, in f64, times the radiance ρE/π. Tolerance: 4π·Y·L
/// over the share of the sphere that the sheet covers (at most a quarter), for 4096 paths that are more even than random ones: 0.06 L.
#[test]
fn probes_gather_band_four() {
    let (albedo, light, half) = (0.8, 2.0, 0.5f32);
    let sheet = lucerna::scene::Mesh {
        positions: [[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]]
            .map(Vec3::from_array)
            .into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Default::default()
    };
    let material = lucerna::scene::Material { double_sided: true, ..lambert(albedo) };
    let mut scene = world(vec![sheet], vec![material]);
    scene
        .lights
        .push(Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(light) });
    scene.sky = lucerna::scene::Sky::Constant(Vec3::ZERO);
    let scene = upload(&scene);
    let chosen = settings!(ProbeSettings {
        cells: 6,
        n_paths: 4096,
        n_bounces: 2,
        moves: false,
        basis: ProbeBasis::Sh4,
    });
    let probes = updated(&scene, chosen, 64);
    let all = gathered(&probes);
    let capacity = probes.lattice().unwrap().capacity as usize;
    let radiance = f64::from(albedo) * f64::from(light) / PI;
    // Real functions of band 4, z up, in f64 (P.-P. Sloan, "Stupid Spherical Harmonics Tricks", 2008, appendix A2).
    let root = |x: f64| (x / PI).sqrt();
    let band_four = |d: DVec3| {
        let DVec3 { x, y, z } = d;
        [
            0.75 * root(35.0) * x * y * (x * x - y * y),
            0.75 * root(17.5) * y * z * (3.0 * x * x - y * y),
            0.75 * root(5.0) * x * y * (7.0 * z * z - 1.0),
            0.75 * root(2.5) * y * z * (7.0 * z * z - 3.0),
            3.0 / 16.0 * root(1.0) * (35.0 * z.powi(4) - 30.0 * z * z + 3.0),
            0.75 * root(2.5) * x * z * (7.0 * z * z - 3.0),
            0.375 * root(5.0) * (x * x - y * y) * (7.0 * z * z - 1.0),
            0.75 * root(17.5) * x * z * (x * x - 3.0 * y * y),
            3.0 / 16.0 * root(35.0) * (x.powi(4) - 6.0 * x * x * y * y + y.powi(4)),
        ]
    };
    let mut n_judged = 0;
    for (probe, placed) in placed(&probes).into_iter().enumerate() {
        if placed.at.y < 0.05 {
            continue;
        }
        n_judged += 1;
        let n = 200;
        let edge = 2.0 * f64::from(half) / f64::from(n);
        let mut expected = [0.0; 9];
        for ix in 0..n * n {
            let [x, z] = [ix % n, ix / n].map(|k| (f64::from(k) + 0.5) * edge - f64::from(half));
            let to = DVec3::new(x, 0.0, z) - placed.at;
            let solid = edge * edge * -to.y / to.length().powi(3);
            for (sum, y) in expected.iter_mut().zip(band_four(to.normalize())) {
                *sum += radiance * solid * y;
            }
        }
        for (k, expected) in expected.iter().enumerate() {
            let found = f64::from(all[(capacity + probe) * COEFFICIENTS as usize + k][0]);
            assert!(
                (found - expected).abs() < 0.06 * radiance,
                "probe at {}, function {k}: {found}, expected {expected}",
                placed.at
            );
        }
    }
    assert!(n_judged > 20, "probes above the sheet: {n_judged}");
}

/// Moves of any length below the limit come back, rounded to 1/1024, with their mark.
#[test]
fn places_are_kept() {
    let mut random = Random(42);
    let inputs: Vec<[f32; 4]> = (0..2000)
        .map(|ix| {
            let [x, y, z]: [f32; 3] = std::array::from_fn(|_| random.unit() * 1.2 - 0.6);
            [x, y, z, if ix % 3 == 0 { 1.0 } else { 0.0 }]
        })
        .collect();
    let found: Vec<[f32; 4]> = crate::harness::map(
        "#import lucerna::components::probes::place::{pack_move, place_is_inside, place_moved}
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let place = pack_move(x.xyz, x.w > 0.0);
             return vec4<f32>(place_moved(place), select(0.0, 1.0, place_is_inside(place)));
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(found) {
        for k in 0..3 {
            let expected = input[k].clamp(-0.45, 0.45);
            let off = (found[k] - expected).abs();
            assert!(off <= 0.5 / 1024.0 + 1e-6, "{input:?} becomes {found:?}");
        }
        assert_eq!(found[3], input[3], "the mark of {input:?}");
    }
}

fn updated(scene: &GpuScene, settings: ProbeSettings, n_updates: u32) -> Probes {
    let mut probes = Probes::new(gpu(), scene, settings).unwrap();
    for _ in 0..n_updates {
        submit(|recorder| probes.update(recorder, scene)).unwrap();
    }
    probes
}

fn lit(scene: Scene) -> GpuScene {
    let light =
        Light::Point { position: Vec3::new(0.3, 0.8, 0.2), intensity: Vec3::ONE, range: None };
    upload(&Scene { lights: vec![light], ..scene })
}

/// In a single-sided room at an angle to the grid, probes inside it move away from its walls: all keep a clearance of 0.2 cells (0.15:
/// rays find the nearest point of a wall within 20°). Those behind a wall stay, and are marked.
#[test]
fn probes_move_into_the_open() {
    let turn = Mat3::from_rotation_y(0.4) * Mat3::from_rotation_x(0.3);
    let (min, max) = (DVec3::new(-1.0, -0.7, -1.3), DVec3::new(1.1, 0.9, 1.2));
    let mut walls = room(min.as_vec3(), max.as_vec3());
    for at in &mut walls.positions {
        *at = turn * *at;
    }
    let scene = lit(world(vec![walls], vec![lambert(0.5)]));
    // Distance to the nearest wall [cells], below 0 behind it; and how many walls the point is behind.
    let depth = |probes: &Probes, at: DVec3| {
        let at = turn.as_dmat3().transpose() * at;
        let cell = f64::from(probes.lattice().unwrap().cell);
        let sides = [at - min, max - at].map(|side| side.to_array()).concat();
        let n_behind = sides.iter().filter(|side| **side < 0.0).count();
        (sides.iter().fold(f64::MAX, |a, b| a.min(*b)) / cell, n_behind)
    };
    let still =
        updated(&scene, settings!(ProbeSettings { cells: 11, n_paths: 1, moves: false }), 1);
    let moving = updated(&scene, settings!(ProbeSettings { cells: 11, n_paths: 1 }), 1);
    let mut n = [0; 2];
    for (before, after) in placed(&still).iter().zip(&placed(&moving)) {
        assert_eq!(before.moved, DVec3::ZERO, "probes that do not move");
        assert_eq!(before.corner, after.corner, "corners with and without moves");
        assert!(after.moved.largest() <= 0.45, "{after:?}");
        let ((was, n_was), (is, _)) = (depth(&still, before.at), depth(&moving, after.at));
        if n_was == 0 {
            let least = if was < 0.2 { 0.15 } else { was.min(0.2) };
            assert!(is >= least - 2e-3 && !after.is_inside, "{after:?}: from {was} to {is}");
            n[0] += 1;
        } else if n_was == 1 && was > -1.5 {
            assert!(is == was && after.is_inside, "{after:?}, {was} behind a wall, comes to {is}");
            n[1] += 1;
        }
    }
    assert!(n.iter().all(|n| *n > 20), "probes that were judged: {n:?}");
    let moved = placed(&moving).iter().filter(|probe| probe.moved != DVec3::ZERO).count() as u64;
    let inside = placed(&moving).iter().filter(|probe| probe.is_inside).count() as u64;
    for (name, expected) in [("moved from their corners", moved), ("inside something", inside)] {
        let stats = moving.stats();
        let stat = stats.iter().find(|stat| stat.name == name).unwrap();
        assert_eq!(lucerna::blocking::read_stat(gpu(), stat).unwrap(), expected, "{name}");
    }
}

/// A gap of 0.3 cells between two double-sided sheets: probes in it move to its middle at most.
#[test]
fn probes_stay_in_their_gap() {
    let sheet = |x: f32| {
        let corners = [[x, -2.0, -2.0], [x, 2.0, -2.0], [x, 2.0, 2.0], [x, -2.0, 2.0]];
        lucerna::scene::Mesh {
            positions: corners.map(Vec3::from_array).into(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Default::default()
        }
    };
    // Cells of 0.5 m, corners at multiples of it from the middle of the box.
    let (left, right) = (-0.05, 0.1);
    let material = lucerna::scene::Material { double_sided: true, ..lambert(0.5) };
    let scene = lit(world(vec![sheet(left), sheet(right)], vec![material.clone(), material]));
    let probes = updated(&scene, settings!(ProbeSettings { cells: 11, n_paths: 1 }), 1);
    let (left, right) = (f64::from(left), f64::from(right));
    let mut n = 0;
    for probe in placed(&probes) {
        let was = probe.at.x - probe.moved.x * f64::from(probes.lattice().unwrap().cell);
        if was <= left || was >= right || probe.at.y.abs().max(probe.at.z.abs()) > 1.0 {
            continue;
        }
        let off = (probe.at.x - 0.5 * (left + right)).abs() / (right - left);
        assert!(off < 0.1 && !probe.is_inside, "{probe:?} is {off} of the gap from its middle");
        n += 1;
    }
    assert!(n > 4, "probes in the gap: {n}");
}

/// A probe that is marked gets the mean of those around it that are not, by the inverse square of their distance, in f64; others keep what they gathered.
/// Bands are multiplied by the window.
#[test]
fn marked_probes_get_the_light_around_them() {
    let scene = lit(world(vec![room(Vec3::NEG_ONE, Vec3::ONE)], vec![lambert(0.5)]));
    let lambda = 0.05;
    let chosen = settings!(ProbeSettings {
        cells: 9,
        n_paths: 64,
        moves: false,
        window: lambda,
        basis: ProbeBasis::Sh2Float,
    });
    let probes = updated(&scene, chosen, 1);
    let all = placed(&probes);
    let light: Vec<[f32; 27]> =
        bytemuck::pod_collect_to_vec(&read(probes.light())[..all.len() * 108]);
    let gathered = gathered(&probes);
    let of = |probe: usize, k: usize| {
        Vec3::from_slice(&gathered[probe * COEFFICIENTS as usize + k]).as_dvec3()
    };
    let mut n_marked = 0;
    for (ix, probe) in all.iter().enumerate() {
        // (Those one corner away; only if there are none, those two or four away.)
        let at_stride = |stride: i32| -> Vec<(usize, f64)> {
            all.iter()
                .enumerate()
                .filter_map(|(other, of)| {
                    let step = of.corner.as_ivec3() - probe.corner.as_ivec3();
                    let is_near = step.abs().max_element() == stride
                        && (0..3).all(|k| step[k] % stride == 0)
                        && !of.is_inside;
                    let apart = f64::from((step / stride).length_squared());
                    is_near.then(|| (other, 1.0 / apart))
                })
                .collect()
        };
        let rings = [1, 2, 4].map(at_stride);
        let around = rings.into_iter().find(|ring| !ring.is_empty()).unwrap_or_default();
        let is_dilated = probe.is_inside && !around.is_empty();
        n_marked += usize::from(is_dilated);
        let total: f64 = around.iter().map(|(_, weight)| weight).sum();
        for k in 0..9 {
            let mean = if is_dilated {
                around.iter().map(|(other, weight)| of(*other, k) * *weight).sum::<DVec3>() / total
            } else {
                of(ix, k)
            };
            let band = [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0f64][k];
            let expected = mean / (1.0 + f64::from(lambda) * (band * (band + 1.0)).powi(2));
            let found = Vec3::from_slice(&light[ix][3 * k..]).as_dvec3();
            // (f32's roundings of what is added up.)
            let of_all = around.iter().map(|(other, _)| of(*other, k).largest());
            let limit = 1e-5 * of_all.fold(of(ix, k).largest(), f64::max_nan);
            assert!(
                (found - expected).largest() <= limit + 1e-30,
                "{probe:?}, coefficient {k}: {found}, expected {expected}"
            );
        }
    }
    assert!(n_marked > 50, "marked probes: {n_marked}");
}

/// What a field gives at points with normals: rgb and the weight.
pub fn look_up(probes: &Probes, queries: &[(Vec3, Vec3)]) -> Vec<[f32; 4]> {
    let text = "
        #import lucerna::fields::probes::probe_irradiance
        struct Query { position: vec3<f32>, reserved: f32, normal: vec3<f32>, reserved_b: f32 }
        @group(1) @binding(0) var<storage, read> queries: array<Query>;
        @group(1) @binding(1) var<storage, read_write> found: array<vec4<f32>>;
        @compute @workgroup_size(64)
        fn main(@builtin(global_invocation_id) id: vec3<u32>) {
            if id.x < arrayLength(&queries) {
                found[id.x] = probe_irradiance(queries[id.x].position, queries[id.x].normal);
            }
        }";
    let shaders = Shaders::new(probes.variant(Variant::BASELINE)).with_module(Source {
        import_path: "lucerna::kernels::tests::look_up".into(),
        file: "look_up.wgsl".into(),
        text: text.into(),
    });
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "tests/look_up");
    let input: Vec<[f32; 8]> =
        queries.iter().map(|(p, n)| [p.x, p.y, p.z, 0.0, n.x, n.y, n.z, 0.0]).collect();
    let queries = storage(bytemuck::cast_slice(&input));
    let found = storage(&vec![0; 16 * input.len()]);
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("tests/look_up"))
            .bind("queries", &queries)
            .bind("found", &found)
            .with(probes.field())
            .dispatch(Dispatch::Items(input.len() as u32));
    });
    bytemuck::pod_collect_to_vec(&read(&found))
}

/// Few surfaces in much air, and probes whose constant is a function of their corner, everything else 0.
fn with_constants(settings: ProbeSettings, mut of: impl FnMut(&Placed) -> f64) -> Probes {
    let positions = [[0.2, 0.1, 0.3], [0.9, 0.2, 0.1], [3.7, 2.3, 1.9]].map(Vec3::from_array);
    let sheet = lucerna::scene::Mesh {
        positions: positions.into(),
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    // (Of two sides: no probe is behind it.)
    let material = lucerna::scene::Material { double_sided: true, ..lambert(0.5) };
    let scene = upload(&world(vec![sheet], vec![material]));
    let probes = updated(&scene, settings, 1);
    let mut words = vec![[0f32; 27]; placed(&probes).len()];
    for (words, probe) in words.iter_mut().zip(&placed(&probes)) {
        words[..3].fill(of(probe) as f32);
    }
    gpu().queue.write_buffer(probes.light(), 0, bytemuck::cast_slice(&words));
    probes
}

const PLAIN: fn(u32) -> ProbeSettings = |cells| {
    settings!(ProbeSettings {
        cells,
        n_paths: 1,
        moves: false,
        basis: ProbeBasis::Sh2Float,
        visibility: ProbeVisibility::None,
        wraps: false,
        roots: false,
    })
};

/// Points anywhere in the box of the lattice, in the air and at surfaces.
fn points(probes: &Probes, random: &mut Random, n: usize) -> Vec<Vec3> {
    let lattice = probes.lattice().unwrap();
    let extent = (lattice.size - 1).as_vec3() * lattice.cell;
    let mut point = || Vec3::new(random.unit(), random.unit(), random.unit());
    (0..n).map(|_| lattice.origin + extent * point()).collect()
}

/// A linear function of space comes back as it is, everywhere: in cells with eight probes of their own, in the wide cells of the air,
/// between both, and at the border, where a lattice is no multiple of wide cells. And a constant whatever sees or wraps. Outside, the
/// border's value goes on.
#[test]
fn a_linear_field_comes_back() {
    let mut random = Random(43);
    for cells in [7, 16, 30] {
        let slope = DVec3::new(0.7, -0.4, 0.2);
        let value = |at: DVec3| 9.0 + slope.dot(at);
        let probes = with_constants(PLAIN(cells), |probe| value(probe.at));
        let inside = points(&probes, &mut random, 2000);
        let outside: Vec<Vec3> = (0..300).map(|_| 40.0 * random.direction()).collect();
        let all: Vec<(Vec3, Vec3)> =
            inside.iter().chain(&outside).map(|p| (*p, random.direction())).collect();
        let lattice = probes.lattice().unwrap();
        let low = lattice.origin.as_dvec3();
        let high = low + (lattice.size - 1).as_dvec3() * f64::from(lattice.cell);
        for ((at, _), found) in all.iter().zip(look_up(&probes, &all)) {
            // A constant c of radiance is an irradiance of πY₀₀c.
            let expected = PI * (1.0 / (4.0 * PI)).sqrt() * value(at.as_dvec3().clamp(low, high));
            let found = f64::from(found[1]);
            assert!(
                (found - expected).abs() < 1e-4 * expected.abs(),
                "{cells} cells, at {at}: {found}, expected {expected}"
            );
        }
        let chosen = settings!(ProbeSettings {
            visibility: ProbeVisibility::Distances,
            wraps: true,
            moves: true,
            ..PLAIN(cells)
        });
        let probes = with_constants(chosen, |_| 2.0);
        let expected = PI * (1.0 / (4.0 * PI)).sqrt() * 2.0;
        for ((at, _), found) in all.iter().zip(look_up(&probes, &all)) {
            let found = f64::from(found[0]);
            assert!((found - expected).abs() < 1e-4 * expected, "{cells} cells, at {at}: {found}");
        }
    }
}

/// Whatever probes hold, no step shows at the borders of cells, small or wide: over a distance of 2e-4 cells, light between 0 and 1 changes by less
/// than 3 · 2e-4 (the steepest trilinear function), and f32's roundings of positions.
#[test]
fn cells_have_no_cracks() {
    let mut random = Random(44);
    let mut hash = Random(45);
    let probes = with_constants(PLAIN(21), |_| f64::from(hash.unit()) / (PI / (4.0 * PI).sqrt()));
    let lattice = probes.lattice().unwrap();
    let mut pairs = Vec::new();
    for at in points(&probes, &mut random, 4000) {
        let axis = random.bits() as usize % 3;
        let mut grid = (at - lattice.origin) / lattice.cell;
        grid[axis] = grid[axis].round();
        for side in [-1e-4, 1e-4] {
            let mut beside = grid;
            beside[axis] += side;
            pairs.push((lattice.origin + beside * lattice.cell, Vec3::Y));
        }
    }
    let found = look_up(&probes, &pairs);
    let mut most = 0.0f32;
    for (two, at) in found.chunks_exact(2).zip(pairs.chunks_exact(2)) {
        let step = (two[0][0] - two[1][0]).abs();
        assert!(step < 1e-3, "a step of {step} at {:?}", at[0].0);
        most = most.max_nan(two[0][0]);
    }
    assert!(most > 0.5, "light is at most {most}");
}

/// Light from one direction rings: for normals away from it, the harmonics of order 2 are below 0, down to 3.7 % of the front, which is cut; straight
/// behind they are 1/17 of the front: 1/4 − 1/2 + 5/16 of 1/4 + 1/2 + 5/16.
#[test]
fn lobes_below_zero_are_cut() {
    let probes = with_constants(PLAIN(8), |_| 0.0);
    let light = light_of(&[(DVec3::X, DVec3::ONE)]);
    let words: Vec<f32> = light.iter().flat_map(|c| c.as_vec3().to_array()).collect();
    let all = words.repeat(placed(&probes).len());
    gpu().queue.write_buffer(probes.light(), 0, bytemuck::cast_slice(&all));
    let normals: Vec<(Vec3, Vec3)> = (0..=180u16)
        .map(|degrees| {
            (
                Vec3::ONE,
                Vec3::new(
                    f32::from(degrees).to_radians().cos(),
                    f32::from(degrees).to_radians().sin(),
                    0.0,
                ),
            )
        })
        .collect();
    let mut n_cut = 0;
    for ((_, normal), found) in normals.iter().zip(look_up(&probes, &normals)) {
        let expected = irradiance(&light, 3, normal.as_dvec3()).x;
        n_cut += usize::from(expected < 0.0);
        let off = (f64::from(found[0]) - expected.max(0.0)).abs();
        assert!(off < 1e-5, "normal {normal}: {}, expected {}", found[0], expected.max(0.0));
    }
    assert!(n_cut > 20, "normals with irradiance below 0: {n_cut}");
    let [front, back] = [DVec3::X, DVec3::NEG_X].map(|normal| irradiance(&light, 3, normal).x);
    assert!((back / front - 1.0 / 17.0).abs() < 1e-12, "behind: {}", back / front);
}
