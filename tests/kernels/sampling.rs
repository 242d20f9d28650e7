// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/sampling`.

use crate::harness::{Random, gpu, map, map_with, normal_limit};
use crate::statistics::{Chart, assert_chi_square, square_bins};
use glam::{DVec2, DVec3, Vec4};
use std::collections::HashSet;
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use wgpu::util::DeviceExt;

const N: usize = 200_000;
/// The largest number that `unit_float` returns.
const LAST: f32 = 1.0 - 1.0 / (1 << 24) as f32;

/// Seeded u in [0, 1)⁴.
pub fn unit_inputs(n: usize, seed: u64) -> Vec<Vec4> {
    let mut random = Random(seed);
    let mut next = || random.unit();
    (0..n).map(|_| Vec4::new(next(), next(), next(), next())).collect()
}

/// All u of {0, 2⁻²⁴, ½, 1 − 2⁻²⁴}³.
pub fn unit_corners() -> Vec<Vec4> {
    let values = [0.0, 1.0 - LAST, 0.5, LAST];
    let mut out = Vec::new();
    for x in values {
        for y in values {
            out.extend(values.map(|z| Vec4::new(x, y, z, 0.0)));
        }
    }
    out
}

/// Draws directions with `sample` of `u` and checks: unit length (4 roundings of 6e-8 and the
/// 2e-7 of sine and cosine); chi-square against `density`; `pdf` of `d` equal to `density` to 1e-5;
/// `pdf` integrating to 1 over the chart.
fn check_direction_sampler(
    module: &str,
    sample: &str,
    pdf: &str,
    chart: Chart,
    density: impl Fn(DVec3) -> f64 + Copy,
) {
    let mut inputs = unit_corners();
    let n_corners = inputs.len();
    inputs.extend(unit_inputs(N, 11));
    let outputs: Vec<Vec4> = map(
        &format!(
            "#import lucerna::sampling::{module} as module
            alias Input = vec4<f32>;
            alias Output = vec4<f32>;
            fn map(input: vec4<f32>) -> vec4<f32> {{
                let u = input.xy;
                let d = {sample};
                return vec4<f32>(d, {pdf});
            }}"
        ),
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let d = output.truncate().as_dvec3();
        assert!((d.length() - 1.0).abs() < 4e-7, "{sample}: u {input} → {d}");
        let expected = density(d);
        let error = (f64::from(output.w) / expected - 1.0).abs();
        assert!(error < 1e-5 || (output.w - expected as f32).abs() < 1e-7, "{sample}: {output}");
    }
    let directions = outputs[n_corners..].iter().map(|o| o.truncate().as_dvec3());
    let expected: Vec<f64> = chart.integrate(16, density).iter().map(|p| p * N as f64).collect();
    assert_chi_square(sample, &chart.count(directions), &expected);
}

#[test]
fn uniform_hemisphere_is_uniform() {
    check_direction_sampler(
        "hemisphere",
        "module::sample_uniform_hemisphere(u)",
        "module::pdf_uniform_hemisphere()",
        Chart::uniform([24, 32]),
        |d| if d.z >= 0.0 { 0.5 * FRAC_1_PI } else { 0.0 },
    );
}

#[test]
fn cosine_hemisphere_follows_the_cosine() {
    check_direction_sampler(
        "hemisphere",
        "module::sample_cosine_hemisphere(u)",
        "module::pdf_cosine_hemisphere(d.z)",
        Chart::uniform([24, 32]),
        |d| d.z.max(0.0) * FRAC_1_PI,
    );
}

#[test]
fn uniform_sphere_is_uniform() {
    check_direction_sampler(
        "sphere",
        "module::sample_uniform_sphere(u)",
        "module::pdf_uniform_sphere()",
        Chart::uniform([24, 32]),
        |_| 0.25 * FRAC_1_PI,
    );
}

/// Wide, beyond the hemisphere, and narrow as the sun (half angle 0.27°).
#[test]
fn uniform_cone_is_uniform() {
    for cos_max in [0.75f32, 0.0, -0.5, 0.999_989] {
        let exact = f64::from(cos_max);
        let density = 1.0 / (TAU * (1.0 - exact));
        // Bins end where the cone does: (1 − cos_max)/2 = (k/n)^power.
        let power = -((1.0 - exact) / 2.0).log(4.0 / 3.0);
        check_direction_sampler(
            "cone",
            &format!("module::sample_uniform_cone(u, {cos_max:?})"),
            &format!("module::pdf_uniform_cone({cos_max:?})"),
            Chart::about(DVec3::Z, power.max(0.5), [32, 32]),
            // The rounding of the cosine at the rim counts as inside.
            |d| {
                if (d - DVec3::Z).length_squared() / 2.0 <= (1.0 - exact) * (1.0 + 1e-6) {
                    density
                } else {
                    0.0
                }
            },
        );
    }
}

/// Every pdf over the whole sphere, on 256 × 512 midpoints: the integral is 1. Tolerance: densities
/// with an edge on the grid's lines are summed exactly up to f32 (1e-6); the cosine's midpoint rule
/// errs by 1e-5.
#[test]
fn hemisphere_and_sphere_pdfs_integrate_to_one() {
    let nodes = Chart::uniform([1, 1]).nodes(256, 512);
    let inputs: Vec<Vec4> = nodes.iter().map(|(d, _)| d.as_vec3().extend(0.0)).collect();
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::hemisphere::{pdf_uniform_hemisphere, pdf_cosine_hemisphere}
        #import lucerna::sampling::sphere::pdf_uniform_sphere
        #import lucerna::sampling::cone::pdf_uniform_cone
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: vec4<f32>) -> vec4<f32> {
            return vec4<f32>(
                select(0.0, pdf_uniform_hemisphere(), input.z > 0.0),
                pdf_cosine_hemisphere(input.z),
                pdf_uniform_sphere(),
                select(0.0, pdf_uniform_cone(0.75), input.z > 0.75),
            );
        }",
        &inputs,
    );
    for lane in 0..4 {
        let sum: f64 = nodes.iter().zip(&outputs).map(|((_, w), o)| w * f64::from(o[lane])).sum();
        assert!((sum - 1.0).abs() < 2e-5, "pdf {lane}: {sum}");
    }
}

/// Against the map in f64 (tolerance: 2e-7 of sine and cosine, 3 roundings); uniform in polar bins;
/// the pdf is one over the area.
#[test]
fn concentric_disc_is_uniform() {
    let mut inputs = unit_corners();
    let n_corners = inputs.len();
    inputs.extend(unit_inputs(N, 12));
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::disc::{sample_uniform_disc, pdf_uniform_disc}
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: vec4<f32>) -> vec4<f32> {
            return vec4<f32>(sample_uniform_disc(input.xy), pdf_uniform_disc(), 0.0);
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let p = 2.0 * input.truncate().truncate().as_dvec2() - 1.0;
        // Concentric: the square of "radius" r around p, and the arc in proportion.
        let r = p.x.abs().max(p.y.abs());
        let expected = if r == 0.0 {
            DVec2::ZERO
        } else if p.x.abs() > p.y.abs() {
            DVec2::from_angle(PI / 4.0 * p.y / p.x) * p.x
        } else {
            DVec2::from_angle(PI / 2.0 - PI / 4.0 * p.x / p.y) * p.y
        };
        let point = output.truncate().truncate().as_dvec2();
        assert!((point - expected).length() < 5e-7, "u {input}: {point} for {expected}");
        assert!((f64::from(output.z) - FRAC_1_PI).abs() < 3e-8);
    }
    let polar = outputs[n_corners..].iter().map(|o| {
        let p = o.truncate().truncate().as_dvec2();
        [p.length_squared().min(1.0 - 1e-12), p.y.atan2(p.x).rem_euclid(TAU) / TAU]
    });
    let expected = vec![N as f64 / 512.0; 512];
    assert_chi_square("disc", &square_bins(polar, [16, 32]), &expected);
}

/// Heitz's listing in f64 (halving is exact, so only the difference is rounded), and uniform: the
/// barycentrics of a uniform point make (w₁ + w₂)² and w₂/(w₁ + w₂) uniform.
#[test]
fn triangle_is_uniform() {
    let mut inputs = unit_corners();
    let n_corners = inputs.len();
    inputs.extend(unit_inputs(N, 13));
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::triangle::sample_uniform_triangle
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: vec4<f32>) -> vec4<f32> {
            return vec4<f32>(sample_uniform_triangle(input.xy), 0.0, 0.0);
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let (mut x, mut y) = (f64::from(input.x), f64::from(input.y));
        if y > x {
            x *= 0.5;
            y -= x;
        } else {
            y *= 0.5;
            x -= y;
        }
        let (second, third) = (f64::from(output.x), f64::from(output.y));
        assert!((second - x).abs() < 1e-7 && (third - y).abs() < 1e-7, "u {input}: {output}");
        assert!(second >= 0.0 && third >= 0.0 && second + third <= 1.0, "u {input}: {output}");
    }
    let square = outputs[n_corners..].iter().map(|o| {
        let (second, third) = (f64::from(o.x), f64::from(o.y));
        let sum = second + third;
        [sum * sum, if sum > 0.0 { (third / sum).min(1.0 - 1e-12) } else { 0.0 }]
    });
    let expected = vec![N as f64 / 400.0; 400];
    assert_chi_square("triangle", &square_bins(square, [20, 20]), &expected);
}

fn pcg_step(v: u32) -> u32 {
    // PCG-RXS-M-XS 32/32 of a state advanced once, in wide integers.
    let state = ((u64::from(v) * 747_796_405 + 2_891_336_453) % (1 << 32)) as u32;
    let shift = state / (1 << 28) + 4;
    let word = (u64::from(state ^ (state >> shift)) * 277_803_737 % (1 << 32)) as u32;
    word ^ (word >> 22)
}

fn pcg_mix<const D: usize>(v: [u32; D], order: &[[usize; 3]]) -> [u32; D] {
    let mut w = v.map(|x| x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    for round in 0..2 {
        for &[to, a, b] in order {
            w[to] = w[to].wrapping_add(w[a].wrapping_mul(w[b]));
        }
        if round == 0 {
            w = w.map(|x| x ^ (x >> 16));
        }
    }
    w
}

/// Bit for bit, for counters, extremes and random words.
#[test]
fn pcg_matches_integers() {
    let mut random = Random(14);
    let mut inputs: Vec<[u32; 4]> = (0..4096).map(|i| [i, i / 64, i % 64, 0]).collect();
    inputs.extend([[0; 4], [u32::MAX; 4], [1 << 31; 4], [u32::MAX, 0, u32::MAX, 0]]);
    inputs.extend((0..20_000).map(|_| [(); 4].map(|()| (random.bits() >> 32) as u32)));
    let outputs: Vec<[[u32; 4]; 4]> = map(
        "#import lucerna::sampling::pcg::{pcg, pcg3d, pcg4d, unit_float, unit_float_vec4, random_vec4}
        alias Input = vec4<u32>;
        struct Output { one: vec4<u32>, three: vec4<u32>, four: vec4<u32>, unit: vec4<u32> }
        fn map(v: vec4<u32>) -> Output {
            let unit = vec4<f32>(unit_float(v.x), unit_float_vec4(v).yzw);
            let random = random_vec4(v.xy, v.z, v.w);
            let three = vec4<u32>(pcg3d(v.xyz), bitcast<u32>(random.w));
            return Output(vec4<u32>(pcg(v.x), pcg(v.y), pcg(v.z), pcg(v.w)), three, pcg4d(v), bitcast<vec4<u32>>(unit));
        }",
        &inputs,
    );
    let unit = |bits: u32| ((bits >> 8) as f32 / (1 << 24) as f32).to_bits();
    for (&v, output) in inputs.iter().zip(&outputs) {
        let four = pcg_mix(v, &[[0, 1, 3], [1, 2, 0], [2, 0, 1], [3, 1, 2]]);
        let [x, y, z] = pcg_mix([v[0], v[1], v[2]], &[[0, 1, 2], [1, 2, 0], [2, 0, 1]]);
        assert_eq!(output[0], v.map(pcg_step), "pcg of {v:?}");
        assert_eq!(output[1], [x, y, z, unit(four[3])], "pcg3d of {v:?}");
        assert_eq!(output[2], four, "pcg4d of {v:?}");
        assert_eq!(output[3], v.map(unit), "unit_float of {v:?}");
    }
}

/// Streams of neighbouring pixels, frames and dimensions: every pair of components is uniform.
#[test]
fn random_numbers_are_uniform() {
    let inputs: Vec<[u32; 4]> = (0..1 << 18).map(|i| [i % 512, i / 512 % 64, i >> 15, 3]).collect();
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::pcg::random_vec4
        alias Input = vec4<u32>;
        alias Output = vec4<f32>;
        fn map(v: vec4<u32>) -> vec4<f32> { return random_vec4(v.xy, v.z, v.w); }",
        &inputs,
    );
    let expected = vec![outputs.len() as f64 / 1024.0; 1024];
    for a in 0..4 {
        for b in 0..a {
            let points = outputs.iter().map(|o| [f64::from(o[a]), f64::from(o[b])]);
            assert_chi_square(
                &format!("lanes {a}, {b}"),
                &square_bins(points, [32, 32]),
                &expected,
            );
        }
        // The next frame's number knows nothing of this one's.
        let lag = 1 << 15;
        let points = (lag..outputs.len())
            .map(|i| [f64::from(outputs[i][a]), f64::from(outputs[i - lag][a])]);
        let expected: Vec<f64> = expected.iter().map(|e| e * 7.0 / 8.0).collect();
        assert_chi_square(&format!("frames of {a}"), &square_bins(points, [32, 32]), &expected);
    }
}

/// (ix + jitter)/n in f64: 2 roundings of numbers up to 1. One point a cell, and none reaches 1.
#[test]
fn stratified_points_stay_in_their_cells() {
    let mut random = Random(15);
    let mut inputs = Vec::new();
    for (nx, ny) in [(1u32, 1u32), (3, 5), (17, 16), (100, 113), (4096, 4096)] {
        let n_cells = nx * ny;
        for k in 0..n_cells.min(15_000) {
            let ix =
                if n_cells <= 15_000 { k } else { (random.bits() % u64::from(n_cells)) as u32 };
            inputs.push([ix, nx, ny, 0, random.unit().to_bits(), random.unit().to_bits(), 0, 0]);
        }
        inputs.push([n_cells - 1, nx, ny, 1, LAST.to_bits(), LAST.to_bits(), 0, 0]);
    }
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::stratified::{stratified_number, stratified_point}
        struct Input { ix: u32, nx: u32, ny: u32, edge: u32, jitter: vec4<f32> }
        alias Output = vec4<f32>;
        fn map(input: Input) -> vec4<f32> {
            let n = vec2<u32>(input.nx, input.ny);
            let number = stratified_number(input.ix, input.nx * input.ny, input.jitter.x);
            return vec4<f32>(stratified_point(input.ix, n, input.jitter.xy), number, 0.0);
        }",
        &inputs,
    );
    let mut seen = HashSet::new();
    for (&[ix, nx, ny, edge, jx, jy, ..], output) in inputs.iter().zip(&outputs) {
        let jitter = [jx, jy].map(|j| f64::from(f32::from_bits(j)));
        let cell = [ix % nx, ix / nx];
        for (lane, n) in [nx, ny].into_iter().enumerate() {
            let expected = (f64::from(cell[lane]) + jitter[lane]) / f64::from(n);
            assert!((f64::from(output[lane]) - expected).abs() < 1.3e-7, "{ix} of {nx} × {ny}");
        }
        let expected = (f64::from(ix) + jitter[0]) / f64::from(nx * ny);
        assert!((f64::from(output.z) - expected).abs() < 1.3e-7, "{ix} of {}: {output}", nx * ny);
        assert!(output.x < 1.0 && output.y < 1.0 && output.z < 1.0, "{output}");
        if edge == 0 && nx < 4096 {
            let hit = [(output.x * nx as f32) as u32, (output.y * ny as f32) as u32];
            assert!(seen.insert((nx, ny, hit)), "two points in cell {hit:?} of {nx} × {ny}");
            assert_eq!(hit, cell);
        }
    }
    // The jitter is handed through: uniform within the cells.
    let within = inputs.iter().zip(&outputs).filter(|(i, _)| i[1] == 100 && i[3] == 0);
    let points: Vec<_> = within
        .map(|(_, o)| [(f64::from(o.x) * 100.0).fract(), (f64::from(o.y) * 113.0).fract()])
        .collect();
    let expected = vec![points.len() as f64 / 64.0; 64];
    assert_chi_square("jitter", &square_bins(points, [8, 8]), &expected);
}

fn indices(seed: u64) -> Vec<u32> {
    let mut random = Random(seed);
    let mut out: Vec<u32> = (0..16_384).collect();
    out.extend((0..31).flat_map(|k| [1u32 << k, (2u32 << k).wrapping_sub(1)]));
    out.extend((0..10_000).map(|_| (random.bits() >> 32) as u32));
    out
}

/// Digit by digit in f64 (exact: 32 digits), cut to 24 digits; R2 in f64 with the plastic number.
#[test]
fn radical_inverse_hammersley_and_r_two_match_f64() {
    let inputs = indices(16);
    let outputs: Vec<Vec4> = map(
        "#import lucerna::sampling::low_discrepancy::{radical_inverse, radical_inverse_bits, hammersley, r_two}
        alias Input = u32;
        alias Output = vec4<f32>;
        fn map(ix: u32) -> vec4<f32> {
            return vec4<f32>(radical_inverse(ix), hammersley(ix & 0xfffu, 4096u).xy, f32(radical_inverse_bits(ix) == reverseBits(ix)));
        }",
        &inputs,
    );
    let inverse = |mut ix: u32| {
        let (mut value, mut digit) = (0.0f64, 0.5);
        while ix > 0 {
            value += digit * f64::from(ix % 2);
            (ix, digit) = (ix / 2, digit / 2.0);
        }
        value
    };
    for (&ix, o) in inputs.iter().zip(&outputs) {
        let cut = (inverse(ix) * f64::from(1 << 24)).floor() / f64::from(1 << 24);
        assert_eq!(f64::from(o.x), cut, "radical inverse of {ix}");
        let low = ix % 4096;
        assert_eq!([f64::from(o.y), f64::from(o.z)], [f64::from(low) / 4096.0, inverse(low)]);
        assert_eq!(o.w, 1.0);
    }
    let outputs: Vec<[f32; 2]> = map(
        "#import lucerna::sampling::low_discrepancy::r_two
        alias Input = u32;
        alias Output = vec2<f32>;
        fn map(ix: u32) -> vec2<f32> { return r_two(ix); }",
        &inputs,
    );
    const PLASTIC: f64 = 1.324_717_957_244_746;
    for (&ix, o) in inputs.iter().zip(&outputs).filter(|&(&ix, _)| ix < 1 << 24) {
        for (value, alpha) in o.iter().zip([1.0 / PLASTIC, 1.0 / (PLASTIC * PLASTIC)]) {
            let expected = (0.5 + f64::from(ix) * alpha).fract();
            let error = (f64::from(*value) - expected + 0.5).rem_euclid(1.0) - 0.5;
            // 2⁻²⁴ of cutting, ix·2⁻³³ of the constant, ix·2⁻⁵² of the oracle.
            let bound = 2f64.powi(-24) + f64::from(ix) * 1.2e-10;
            assert!(error.abs() <= bound, "R2 of {ix}: {value} for {expected}");
        }
    }
}

/// Second dimension by Joe & Kuo's recurrence (s = 1, a = 0, m₁ = 1), first by mirrored digits.
fn sobol(ix: u32) -> [u32; 2] {
    let mut m = [1u32; 32];
    for k in 1..32 {
        m[k] = (2 * u64::from(m[k - 1])) as u32 ^ m[k - 1];
    }
    (0..32)
        .filter(|k| ix >> k & 1 == 1)
        .fold([0; 2], |[x, y], k| [x ^ (1 << (31 - k)), y ^ ((u64::from(m[k]) << (31 - k)) as u32)])
}

/// Bit for bit, and the published first points (Bratley & Fox 1988, in order of the index).
#[test]
fn sobol_matches_direction_numbers() {
    let inputs = indices(17);
    let outputs: Vec<[u32; 2]> = map(
        "#import lucerna::sampling::low_discrepancy::sobol_bits
        alias Input = u32;
        alias Output = vec2<u32>;
        fn map(ix: u32) -> vec2<u32> { return sobol_bits(ix); }",
        &inputs,
    );
    for (&ix, &output) in inputs.iter().zip(&outputs) {
        assert_eq!(output, sobol(ix), "point {ix}");
    }
    let published = [
        [0.0, 0.0],
        [0.5, 0.5],
        [0.25, 0.75],
        [0.75, 0.25],
        [0.125, 0.625],
        [0.625, 0.125],
        [0.375, 0.375],
        [0.875, 0.875],
    ];
    for (output, published) in outputs.iter().zip(published) {
        assert_eq!(output.map(|bits| f64::from(bits) / 2f64.powi(32)), published);
    }
}

/// Whether each elementary interval 2⁻ᵃ × 2⁻⁽ᵏ⁻ᵃ⁾ holds exactly one of 2ᵏ points.
fn assert_net(what: &str, points: &[[f32; 2]]) {
    let k = points.len().ilog2();
    for a in 0..=k {
        let mut seen = vec![false; points.len()];
        for &[x, y] in points {
            let (i, j) = ((x * (1 << a) as f32) as usize, (y * (1 << (k - a)) as f32) as usize);
            let cell = (j << a) + i;
            assert!(!seen[cell], "{what}: two points in cell ({i}, {j}) of 2^{a} × 2^{}", k - a);
            seen[cell] = true;
        }
    }
}

/// Every aligned block of 2ᵏ points, k ≤ 12, is a (0,2)-net, plain and for 24 seeds.
#[test]
fn sobol_is_a_net_and_scrambling_keeps_it() {
    const BLOCK: u32 = 4096;
    let seeds: Vec<u32> = (0..24).map(|i| if i < 8 { i } else { pcg_step(i) }).collect();
    let mut inputs = Vec::new();
    for &seed in &seeds {
        inputs.extend((0..BLOCK).map(|ix| [ix + BLOCK * (seed % 7), seed]));
    }
    let outputs: Vec<[f32; 4]> = map(
        "#import lucerna::sampling::low_discrepancy::{sobol_bits, sobol_owen}
        #import lucerna::sampling::pcg::unit_float
        alias Input = vec2<u32>;
        alias Output = vec4<f32>;
        fn map(input: vec2<u32>) -> vec4<f32> {
            let plain = sobol_bits(input.x);
            return vec4<f32>(unit_float(plain.x), unit_float(plain.y), sobol_owen(input.x, input.y));
        }",
        &inputs,
    );
    for (seed, block) in seeds.iter().zip(outputs.chunks(BLOCK as usize)) {
        for k in 0..=12 {
            for (part, points) in block.chunks(1 << k).enumerate().take(16) {
                let plain: Vec<_> = points.iter().map(|p| [p[0], p[1]]).collect();
                assert_net(&format!("plain, 2^{k}, part {part}"), &plain);
                let owen: Vec<_> = points.iter().map(|p| [p[2], p[3]]).collect();
                assert_net(&format!("seed {seed}, 2^{k}, part {part}"), &owen);
            }
        }
    }
}

/// Bit for bit against integers, and Owen's property: the k high bits of the result depend on the k
/// high bits of the argument alone, one to one.
#[test]
fn owen_scrambling_permutes_each_level() {
    let reference = |bits: u32, seed: u32| {
        let mut x = bits.reverse_bits();
        x ^= x.wrapping_mul(0x3d20_adea);
        x = x.wrapping_add(seed).wrapping_mul((seed >> 16) | 1);
        x ^= x.wrapping_mul(0x0552_6c56);
        x ^= x.wrapping_mul(0x53a2_2864);
        x.reverse_bits()
    };
    let mut random = Random(18);
    let seeds: Vec<u32> =
        (0..8).map(|_| (random.bits() >> 32) as u32).chain([0, u32::MAX]).collect();
    let mut inputs = Vec::new();
    for &seed in &seeds {
        for high in 0..1024u32 {
            inputs.push([high << 22, seed]);
            inputs.push([(high << 22) | ((random.bits() >> 42) as u32), seed]);
        }
    }
    let outputs: Vec<u32> = map(
        "#import lucerna::sampling::low_discrepancy::owen_scramble
        alias Input = vec2<u32>;
        alias Output = u32;
        fn map(input: vec2<u32>) -> u32 { return owen_scramble(input.x, input.y); }",
        &inputs,
    );
    for (&[bits, seed], &output) in inputs.iter().zip(&outputs) {
        assert_eq!(output, reference(bits, seed), "{bits:08x} by {seed:08x}");
    }
    for block in outputs.chunks(2048) {
        let high: Vec<u32> = block.iter().map(|o| o >> 22).collect();
        assert!(high.chunks(2).all(|pair| pair[0] == pair[1]), "low bits reach up");
        assert_eq!(high.iter().collect::<HashSet<_>>().len(), 1024, "not one to one");
    }
}

/// A scrambled point over all seeds is uniform, whatever its index, and two of them are independent
/// except for the strata that they share.
#[test]
fn scrambled_points_are_uniform_over_seeds() {
    for ix in [0u32, 1, 5, 1000] {
        let inputs: Vec<[u32; 2]> = (0..131_072).map(|seed| [ix, seed]).collect();
        let outputs: Vec<[f32; 2]> = map(
            "#import lucerna::sampling::low_discrepancy::sobol_owen
            alias Input = vec2<u32>;
            alias Output = vec2<f32>;
            fn map(input: vec2<u32>) -> vec2<f32> { return sobol_owen(input.x, input.y); }",
            &inputs,
        );
        let expected = vec![inputs.len() as f64 / 1024.0; 1024];
        let points = outputs.iter().map(|o| o.map(f64::from));
        assert_chi_square(&format!("point {ix}"), &square_bins(points, [32, 32]), &expected);
    }
}

/// In f64, for magnitudes from 1e-30 to 1e30 and zeros: 5 roundings. The weights of both strategies
/// sum to 1.
#[test]
fn heuristics_match_f64() {
    let mut random = Random(19);
    let mut inputs = vec![[0.0f32, 0.0], [0.0, 1.0], [1.0, 0.0], [1e-30, 1e30], [f32::MAX, 1.0]];
    inputs.push([f32::MAX, f32::MAX / 4.0]);
    inputs.extend((0..20_000).map(|_| {
        let scale = 10f32.powf(random.range(-30.0, 30.0));
        [scale * random.unit(), scale * 10f32.powf(random.range(-4.0, 4.0))]
    }));
    let outputs: Vec<[f32; 4]> = map(
        "#import lucerna::sampling::mis::{balance_heuristic, power_heuristic}
        alias Input = vec2<f32>;
        alias Output = vec4<f32>;
        fn map(p: vec2<f32>) -> vec4<f32> {
            return vec4<f32>(balance_heuristic(p.x, p.y), power_heuristic(p.x, p.y), balance_heuristic(p.y, p.x), power_heuristic(p.y, p.x));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let [p, q] = input.map(f64::from);
        let [balance, power, other_balance, other_power] = output.map(f64::from);
        if p + q == 0.0 {
            assert_eq!(*output, [0.0; 4]);
            continue;
        }
        // Powers of ratios below 1e-19 underflow to 0.
        let close = |a: f64, b: f64| (a - b).abs() <= 4e-7 * b + 1e-37;
        // GPUs need not divide by more than 2¹²⁶.
        if p + q < 2f64.powi(126) {
            assert!(close(balance, p / (p + q)), "{input:?}: {output:?}");
            assert!((balance + other_balance - 1.0).abs() < 4e-7);
        }
        assert!(close(power, p * p / (p * p + q * q)), "{input:?}: {output:?}");
        assert!((power + other_power - 1.0).abs() < 6e-7);
    }
}

/// A sky's weights, the texture made of them, and the exact probabilities.
struct Sky {
    size: [u32; 2],
    probability: Vec<f64>,
    view: wgpu::TextureView,
}

impl Sky {
    fn new(size: [u32; 2], luminance: impl Fn(u32, u32) -> f64) -> Self {
        let [w, h] = size;
        let weight =
            |x: u32, y: u32| luminance(x, y) * (PI * (f64::from(y) + 0.5) / f64::from(h)).sin();
        let mut texels = vec![0.0f32; ((w + 1) * h) as usize];
        let mut weights = Vec::new();
        for y in 0..h {
            weights.extend((0..w).map(|x| weight(x, y)));
        }
        let total: f64 = weights.iter().sum();
        let mut rows = 0.0;
        for (y, row) in weights.chunks(w as usize).enumerate() {
            let sum: f64 = row.iter().sum();
            rows += sum;
            let texels = &mut texels[y * (w as usize + 1)..][..w as usize + 1];
            texels[0] = if total > 0.0 { (rows / total) as f32 } else { 0.0 };
            let mut columns = 0.0;
            for (texel, value) in texels[1..].iter_mut().zip(row) {
                columns += value;
                *texel = if sum > 0.0 { (columns / sum) as f32 } else { 0.0 };
            }
            // Sums end at 1 exactly, from the last texel that has any weight.
            let last = row.iter().rposition(|&value| value > 0.0).unwrap_or(row.len());
            texels[1..].iter_mut().skip(last).for_each(|texel| *texel = 1.0);
        }
        let last = weights.chunks(w as usize).rposition(|row| row.iter().any(|&v| v > 0.0));
        for y in last.unwrap_or(h as usize)..h as usize {
            texels[y * (w as usize + 1)] = 1.0;
        }
        let gpu = gpu();
        let texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("sky distribution"),
                size: wgpu::Extent3d { width: w + 1, height: h, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::R32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&texels),
        );
        Self {
            size,
            probability: weights
                .iter()
                .map(|v| if total > 0.0 { v / total } else { 0.0 })
                .collect(),
            view: texture.create_view(&Default::default()),
        }
    }

    fn call<O: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
        &self,
        body: &str,
        inputs: &[Vec4],
    ) -> Vec<O> {
        let [w, h] = self.size;
        map_with(
            &format!(
                "#import lucerna::sky::environment::{{sample_environment, pdf_environment}}
                @group(0) @binding(2) var distribution: texture_2d<f32>;
                struct Output {{ direction: vec3<f32>, pdf: f32, uv: vec2<f32>, again: f32, pad: f32 }}
                alias Input = vec4<f32>;
                fn map(input: vec4<f32>) -> Output {{
                    let size = vec2<u32>({w}u, {h}u);
                    {body}
                }}"
            ),
            inputs,
            &[wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&self.view) }],
        )
    }

    fn sample(&self, inputs: &[Vec4]) -> Vec<[f32; 8]> {
        self.call(
            "let s = sample_environment(distribution, size, input.xy);
            return Output(s.direction, s.pdf, s.uv, pdf_environment(distribution, size, s.direction), 0.0);",
            inputs,
        )
    }

    fn density(&self, uv: [f64; 2]) -> f64 {
        let [w, h] = self.size.map(f64::from);
        let (x, y) = ((uv[0] * w) as usize, (uv[1] * h) as usize);
        self.probability[y * w as usize + x] * w * h / (2.0 * PI * PI * (PI * uv[1]).sin())
    }
}

fn skies() -> Vec<(&'static str, Sky)> {
    let mut random = Random(20);
    let noise: Vec<f64> = (0..64 * 32).map(|_| f64::from(random.unit())).collect();
    vec![
        ("one texel", Sky::new([1, 1], |_, _| 1.0)),
        ("uniform", Sky::new([16, 8], |_, _| 0.5)),
        ("noise", Sky::new([64, 32], |x, y| noise[(y * 64 + x) as usize])),
        (
            "noise with gaps and a sun",
            Sky::new([33, 17], |x, y| match (x, y) {
                (20, 5) => 200.0,
                (_, 3 | 16) | (32, _) => 0.0,
                _ if (x + y) % 3 == 0 => 0.0,
                _ => noise[(y * 33 + x) as usize],
            }),
        ),
    ]
}

/// Texel frequencies and places within texels by chi-square on a grid twice as fine as the map;
/// directions on the map's place (2e-6: f32 angles up to 2π and lavapipe's sine); pdf as the texel's
/// probability over its solid angle, and equal to `pdf_environment` of the direction away from texel
/// borders.
///
/// Tolerance of the pdf: probabilities are differences of f32 near 1, so 6e-8·2 absolute on each of
/// row and column; the sine's argument and value are off by 5e-7 absolute.
#[test]
fn environment_follows_its_weights() {
    for (what, sky) in skies() {
        let [w, h] = sky.size.map(|n| n as usize);
        let mut inputs = unit_corners();
        let n_corners = inputs.len();
        inputs.extend(unit_inputs(N, 21));
        let outputs = sky.sample(&inputs);
        let mut n_compared = 0;
        for (input, o) in inputs.iter().zip(&outputs) {
            let [dx, dy, dz, pdf, u, v, again, _] = o.map(f64::from);
            let d = DVec3::new(dx, dy, dz);
            let (phi, theta) = (TAU * u, PI * v);
            let expected =
                DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            assert!((d - expected).length() < 2e-6, "{what}: u {input}: {d} for {expected}");
            assert!(pdf > 0.0 && pdf.is_finite(), "{what}: u {input}: {o:?}");
            let place = [u * w as f64, v * h as f64].map(|x| (x.fract() - 0.5).abs());
            if v > 0.01 && v < 0.99 && place[0] < 0.499 && place[1] < 0.499 {
                let expected = sky.density([u, v]);
                let row: f64 = sky.probability[(v * h as f64) as usize * w..][..w].iter().sum();
                let column =
                    sky.probability[(v * h as f64) as usize * w + (u * w as f64) as usize] / row;
                let bound = 1e-6 + 5e-7 / (PI * v).sin() + 1.2e-7 / row + 1.2e-7 / column;
                assert!((pdf / expected - 1.0).abs() < bound, "{what}: {o:?}: pdf {expected}");
                // The direction's v is known to 2e-5 relative: sin θ near the poles.
                assert!((again / pdf - 1.0).abs() < 1e-4, "{what}: {o:?}");
                n_compared += 1;
            }
        }
        assert!(n_compared > N * 9 / 10);
        let points = outputs[n_corners..].iter().map(|o| [f64::from(o[4]), f64::from(o[5])]);
        let fine = if w == 1 { 8 } else { 2 };
        let mut expected = vec![0.0; w * h * fine * fine];
        for y in 0..h * fine {
            for x in 0..w * fine {
                expected[y * w * fine + x] =
                    sky.probability[y / fine * w + x / fine] * N as f64 / (fine * fine) as f64;
            }
        }
        assert_chi_square(what, &square_bins(points, [w * fine, h * fine]), &expected);
    }
}

/// ∫ pdf dω on 4 × 4 points a texel: 1 to f32's rounding of the distribution and of sin θ.
#[test]
fn environment_pdf_integrates_to_one() {
    for (what, sky) in skies() {
        let [w, h] = sky.size.map(|n| 4 * n as usize);
        let mut inputs = Vec::new();
        let mut weights = Vec::new();
        for y in 0..h {
            for x in 0..w {
                let (u, v) = ((x as f64 + 0.5) / w as f64, (y as f64 + 0.5) / h as f64);
                let (phi, theta) = (TAU * u, PI * v);
                let d = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                inputs.push(d.as_vec3().extend(0.0));
                weights.push(2.0 * PI * PI * theta.sin() / (w * h) as f64);
            }
        }
        let outputs: Vec<[f32; 8]> = sky.call(
            "return Output(vec3<f32>(0.0), 0.0, vec2<f32>(0.0), pdf_environment(distribution, size, input.xyz), 0.0);",
            &inputs,
        );
        let sum: f64 = outputs.iter().zip(&weights).map(|(o, w)| f64::from(o[6]) * w).sum();
        assert!((sum - 1.0).abs() < 2e-5, "{what}: {sum}");
    }
}

/// A black sky has nothing to draw.
#[test]
fn black_environment_has_no_density() {
    let gpu = gpu();
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("black sky"),
        size: wgpu::Extent3d { width: 5, height: 2, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Float,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    let view = texture.create_view(&Default::default());
    let sky = Sky { size: [4, 2], probability: vec![0.0; 8], view };
    for o in sky.sample(&unit_corners()) {
        assert_eq!([o[3], o[6]], [0.0; 2], "{o:?}");
        assert!(o.iter().all(|x| x.is_finite()), "{o:?}");
    }
}

/// The distribution that the host makes of a sky's image, against sums in f64: by luminance (Rec. 709) and the sine of the row's centre, rising to exactly
/// 1; uniform where a row or all is black. Tolerance: a few roundings of sums.
#[test]
fn sky_distribution_sums_the_sky() {
    use glam::Vec3;
    use lucerna::gpu_scene::sky::sky_distribution;
    let mut random = Random(77);
    let [w, h] = [7usize, 5usize];
    let mut sky: Vec<Vec3> =
        (0..w * h).map(|_| Vec3::from_array(std::array::from_fn(|_| random.unit()))).collect();
    sky[2 * w..3 * w].fill(Vec3::ZERO);
    sky[w + 3] = Vec3::new(1e4, 0.0, 0.0);
    for (name, texels) in [("random", sky), ("black", vec![Vec3::ZERO; w * h])] {
        let table = sky_distribution(w as u32, h as u32, &texels);
        assert_eq!(table.len(), (w + 1) * h, "{name}");
        let luminance = |c: Vec3| c.as_dvec3().dot(DVec3::new(0.2126, 0.7152, 0.0722));
        let rows: Vec<f64> = texels
            .chunks(w)
            .enumerate()
            .map(|(y, row)| {
                (PI * (y as f64 + 0.5) / h as f64).sin()
                    * row.iter().map(|&c| luminance(c)).sum::<f64>()
            })
            .collect();
        let cumulative = |parts: &[f64], ix: usize| {
            let total: f64 = parts.iter().sum();
            let even = (ix + 1) as f64 / parts.len() as f64;
            if total > 0.0 { parts[..=ix].iter().sum::<f64>() / total } else { even }
        };
        for y in 0..h {
            let row: Vec<f64> = texels[y * w..(y + 1) * w].iter().map(|&c| luminance(c)).collect();
            let held = &table[y * (w + 1)..(y + 1) * (w + 1)];
            assert!(
                (f64::from(held[0]) - cumulative(&rows, y)).abs() < 1e-6,
                "{name}, row {y}: {held:?}"
            );
            for x in 0..w {
                let expected = cumulative(&row, x);
                assert!(
                    (f64::from(held[x + 1]) - expected).abs() < 1e-6,
                    "{name} ({x}, {y}): {held:?}"
                );
            }
            assert_eq!(held[w], 1.0, "{name}, row {y}");
        }
        assert_eq!(table[(h - 1) * (w + 1)], 1.0, "{name}");
    }
}

/// Both axes of a scrambled point are uniform and independent of each other, over seeds: chi-square of 16 × 16 bins for some
/// points of the sequence.
#[test]
fn axes_of_sobol_points_are_independent_over_seeds() {
    const N: u32 = 1 << 14;
    for point in [0u32, 1, 2, 3, 100] {
        let inputs: Vec<[u32; 2]> = (0..N).map(|seed| [point, seed]).collect();
        let found: Vec<[f32; 2]> = map(
            "#import lucerna::sampling::low_discrepancy::sobol_owen
             alias Input = vec2<u32>;
             alias Output = vec2<f32>;
             fn map(x: Input) -> Output { return sobol_owen(x.x, x.y); }",
            &inputs,
        );
        let mut observed = vec![0u64; 256];
        for [x, y] in found {
            observed[(y * 16.0) as usize * 16 + (x * 16.0) as usize] += 1;
        }
        let expected = vec![f64::from(N) / 256.0; 256];
        assert_chi_square(&format!("point {point}"), &observed, &expected);
    }
}

/// The axes of a point are scrambled independently: which of the upper 8 bits each one's scrambling flips agree in half
/// of the seeds, by the standard deviation of a binomial distribution.
#[test]
fn axes_of_sobol_points_are_scrambled_apart() {
    const N: u32 = 1 << 14;
    let inputs: Vec<[u32; 2]> = (0..N).map(|seed| [seed % 5, seed]).collect();
    let found: Vec<[u32; 2]> = map(
        "#import lucerna::sampling::low_discrepancy::{owen_scramble, sobol_bits, sobol_owen}
         #import lucerna::sampling::pcg::pcg
         alias Input = vec2<u32>;
         alias Output = vec2<u32>;
         fn map(x: Input) -> Output {
             // The point of the shuffled sequence, before its axes are scrambled.
             let point = sobol_bits(owen_scramble(x.x, pcg(x.y))) >> vec2<u32>(24u);
             return point ^ vec2<u32>(sobol_owen(x.x, x.y) * 256.0);
         }",
        &inputs,
    );
    for bit in 0..8 {
        let agree = found.iter().filter(|[x, y]| (x ^ y) >> bit & 1 == 0).count() as f64;
        let off = (agree / f64::from(N) - 0.5).abs() * 2.0 * f64::from(N).sqrt();
        assert!(
            off < normal_limit(8),
            "bit {bit} of both axes is flipped alike in {agree} of {N} seeds, expected half; off by {off:.1} standard deviations"
        );
    }
}
