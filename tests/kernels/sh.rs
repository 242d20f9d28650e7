// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/sh`.

use crate::harness::{KeepNan, Largest, Random, map};
use crate::math::directions;
use glam::{DMat3, DQuat, DVec3};
use std::f64::consts::{PI, TAU};
use std::sync::OnceLock;

const BANDS: usize = 8;

fn factorial(n: usize) -> f64 {
    (1..=n).map(|i| i as f64).product()
}

fn binomial(n: usize, k: usize) -> f64 {
    factorial(n) / (factorial(k) * factorial(n - k))
}

/// The m-th derivative of the Legendre polynomial of degree l, by Rodrigues' explicit sum: its
/// coefficients by power of z.
fn legendre_derivative(l: usize, m: usize) -> Vec<f64> {
    let mut polynomial = vec![0.0; l + 1 - m];
    for k in (0..=l / 2).filter(|k| l - 2 * k >= m) {
        let power = l - 2 * k;
        let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
        let coefficient = binomial(l, k) * binomial(2 * l - 2 * k, l) / 2f64.powi(l as i32);
        polynomial[power - m] = sign * coefficient * factorial(power) / factorial(power - m);
    }
    polynomial
}

fn horner(polynomial: &[f64], z: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, coefficient| sum * z + coefficient)
}

/// K(l, m) · dᵐ/dzᵐ P(l), and √2 of it for m > 0, by l and m.
fn polynomials() -> &'static [Vec<Vec<f64>>] {
    static TABLE: OnceLock<Vec<Vec<Vec<f64>>>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let normalised = |l: usize, m: usize| {
            let k = (2 * l + 1) as f64 / (4.0 * PI) * factorial(l - m) / factorial(l + m);
            let scale = if m == 0 { k.sqrt() } else { (2.0 * k).sqrt() };
            legendre_derivative(l, m).into_iter().map(|c| c * scale).collect()
        };
        (0..BANDS).map(|l| (0..=l).map(|m| normalised(l, m)).collect()).collect()
    })
}

/// Y(l, m) by the definition: associated Legendre functions normalised by factorials, angles, no
/// Condon–Shortley phase. sin θ is taken from x and y, so that a vector that is a rounding off the
/// unit sphere gives the value of the same polynomial.
fn y(l: usize, m: i32, d: DVec3) -> f64 {
    let order = m.unsigned_abs() as usize;
    let (sine, phi) = (d.x.hypot(d.y), d.y.atan2(d.x));
    let p = sine.powi(order as i32) * horner(&polynomials()[l][order], d.z);
    let azimuth = f64::from(m.abs()) * phi;
    if m < 0 { p * azimuth.sin() } else { p * azimuth.cos() }
}

/// (l, m) of each index.
fn bands(n: usize) -> Vec<(usize, i32)> {
    (0..BANDS).flat_map(|l| (-(l as i32)..=l as i32).map(move |m| (l, m))).take(n).collect()
}

/// No function of band l exceeds it (the addition theorem).
fn band_max(l: usize) -> f64 {
    ((2 * l + 1) as f64 / (4.0 * PI)).sqrt()
}

/// The first `n` functions at a unit vector, by the definition.
pub fn all_y(n: usize, d: DVec3) -> Vec<f64> {
    bands(n).into_iter().map(|(l, m)| y(l, m, d)).collect()
}

/// Gauss–Legendre nodes and weights on [−1, 1].
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let p = |degree: usize, z: f64| {
        let (mut before, mut current) = (0.0, 1.0);
        for k in 0..degree {
            let next = ((2 * k + 1) as f64 * z * current - k as f64 * before) / (k + 1) as f64;
            (before, current) = (current, next);
        }
        (current, before)
    };
    (0..n)
        .map(|i| {
            let mut z = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            let mut slope = 0.0;
            for _ in 0..50 {
                let (value, before) = p(n, z);
                slope = n as f64 * (z * value - before) / (z * z - 1.0);
                z -= value / slope;
            }
            (z, 2.0 / ((1.0 - z * z) * slope * slope))
        })
        .collect()
}

/// Directions and weights (sr) that integrate polynomials of degree 15 over the sphere exactly.
fn sphere_rule() -> Vec<(DVec3, f64)> {
    let n_phi = 20;
    gauss_legendre(10)
        .into_iter()
        .flat_map(|(z, weight)| {
            (0..n_phi).map(move |i| {
                let phi = TAU * (i as f64 + 0.3) / n_phi as f64;
                let sine = (1.0 - z * z).sqrt();
                (DVec3::new(sine * phi.cos(), sine * phi.sin(), z), weight * TAU / n_phi as f64)
            })
        })
        .collect()
}

type Slot = [f32; 4];

fn slot(v: DVec3) -> Slot {
    let v = v.as_vec3();
    [v.x, v.y, v.z, 0.0]
}

fn vector(slot: Slot) -> DVec3 {
    DVec3::new(slot[0].into(), slot[1].into(), slot[2].into())
}

/// Random RGB coefficients in [−1, 1], each a slot.
fn coefficients<const N: usize>(random: &mut Random) -> [Slot; N] {
    [(); N]
        .map(|()| [random.range(-1.0, 1.0), random.range(-1.0, 1.0), random.range(-1.0, 1.0), 0.0])
}

/// Σ cⱼ Yⱼ(d).
fn evaluate(c: &[Slot], d: DVec3) -> DVec3 {
    c.iter().zip(all_y(c.len(), d)).map(|(&c, y)| vector(c) * y).sum()
}

/// Σ |cⱼ| max |Yⱼ|, to which errors are relative.
fn magnitude(c: &[Slot]) -> f64 {
    c.iter().zip(bands(c.len())).map(|(&c, (l, _))| vector(c).largest() * band_max(l)).sum()
}

fn direction_slots(n: usize, seed: u64) -> Vec<Slot> {
    directions(n, seed).iter().map(|d| [d.x, d.y, d.z, 0.0]).collect()
}

fn check_basis<const N: usize>(name: &str, inputs: &[Slot]) -> Vec<[f32; N]>
where
    [f32; N]: bytemuck::Pod,
{
    let outputs: Vec<[f32; N]> = map(
        &format!(
            "#import lucerna::sh::basis::{name}
            alias Input = vec4<f32>;
            alias Output = array<f32, {N}>;
            fn map(input: Input) -> Output {{ return {name}(input.xyz); }}"
        ),
        inputs,
    );
    let mut worst = [0.0f64; BANDS];
    for (input, output) in inputs.iter().zip(&outputs) {
        for (ix, (l, m)) in bands(N).into_iter().enumerate() {
            let expected = y(l, m, vector(*input));
            let error = (f64::from(output[ix]) - expected).abs() / band_max(l);
            // 8 roundings a band where each operation is rounded (1e-6); GPUs fuse and divide to 2.5 ulp, and double it.
            assert!(
                error < 2e-6,
                "{name}: Y({l}, {m}) of {input:?} is {}, expected {expected} within 2e-6 of the band's largest",
                output[ix]
            );
            worst[l] = worst[l].max_nan(error);
        }
    }
    eprintln!("{name}: worst errors by band {worst:.1?}e-9", worst = worst.map(|e| e * 1e9));
    outputs
}

/// Relative to the greatest value of the band. Each step of the recurrence rounds five times and keeps
/// earlier errors bounded: 7 · 5 u/2 = 1e-6.
#[test]
fn basis_equals_the_definition() {
    let inputs = direction_slots(10_000, 1);
    check_basis::<4>("sh1_basis", &inputs);
    check_basis::<9>("sh2_basis", &inputs);
    check_basis::<64>("sh_basis", &inputs);
}

/// One by one, in the tolerance of the test above; bands of indices exactly.
#[test]
fn single_functions_equal_the_definition() {
    let mut inputs: Vec<Slot> = Vec::new();
    for d in direction_slots(200, 2) {
        inputs.extend((0..64).map(|ix| [d[0], d[1], d[2], ix as f32]));
    }
    let outputs: Vec<[f32; 2]> = map(
        "#import lucerna::sh::basis::{sh_basis_function, sh_band}
        alias Input = vec4<f32>;
        alias Output = vec2<f32>;
        fn map(input: Input) -> Output {
            let l = sh_band(u32(input.w));
            let m = i32(input.w) - i32(l * (l + 1u));
            return vec2<f32>(sh_basis_function(l, m, input.xyz), f32(l));
        }",
        &inputs,
    );
    let table = bands(64);
    for (input, output) in inputs.iter().zip(&outputs) {
        let (l, m) = table[input[3] as usize];
        assert_eq!(output[1] as usize, l, "band of function {}", input[3]);
        let expected = y(l, m, vector(*input));
        let error = (f64::from(output[0]) - expected).abs() / band_max(l);
        assert!(
            error < 1e-6,
            "Y({l}, {m}) of {input:?} is {}, expected {expected} within 1e-6 of the band's largest",
            output[0]
        );
    }
}

/// ∫ Yᵢ Yⱼ dω = δᵢⱼ. A value's error of 1e-6 of the band's maximum is at most 1e-6 · √15 in the norm
/// of L², twice; rounding the directions moves values by at most l(l + 1)/2 · 6e-8 of it: 1.5e-5.
#[test]
fn basis_is_orthonormal() {
    let rule = sphere_rule();
    let inputs: Vec<Slot> = rule.iter().map(|(d, _)| slot(*d)).collect();
    let outputs = check_basis::<64>("sh_basis", &inputs);
    let mut worst = 0.0f64;
    for i in 0..64 {
        for j in 0..64 {
            let product: f64 = rule
                .iter()
                .zip(&outputs)
                .map(|((_, w), y)| w * f64::from(y[i]) * f64::from(y[j]))
                .sum();
            let error = (product - f64::from(u8::from(i == j))).abs();
            assert!(
                error < 1.5e-5,
                "⟨Y{i}, Y{j}⟩ is {product}, expected {} within 1.5e-5",
                u8::from(i == j)
            );
            worst = worst.max_nan(error);
        }
    }
    eprintln!("orthonormality: worst {worst:e}");
}

/// Error relative to Σ|cⱼ| max|Yⱼ|: that of the basis, 1e-6, and of N sums, at most (N + 1) u.
#[test]
fn evaluation_is_the_sum() {
    fn check<const N: usize>(name: &str, n_inputs: usize)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(N as u64);
        let directions = directions(n_inputs, 3);
        let inputs: Vec<[Slot; N]> = directions
            .iter()
            .map(|d| {
                let mut c = coefficients::<N>(&mut random);
                (c[0][3], c[1][3], c[2][3]) = (d.x, d.y, d.z);
                c
            })
            .collect();
        let outputs: Vec<Slot> = map(
            &format!(
                "#import lucerna::sh::evaluate::{name}
                alias Input = array<vec4<f32>, {N}>;
                alias Output = vec4<f32>;
                fn map(input: Input) -> Output {{
                    var slots = input;
                    var c: array<vec3<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ c[i] = slots[i].xyz; }}
                    let direction = vec3<f32>(slots[0].w, slots[1].w, slots[2].w);
                    return vec4<f32>({name}(c, direction), 0.0);
                }}"
            ),
            &inputs,
        );
        let tolerance = 1e-6 + (N + 1) as f64 * 6e-8;
        for ((input, direction), output) in inputs.iter().zip(&directions).zip(&outputs) {
            let expected = evaluate(input, direction.as_dvec3());
            let error = (vector(*output) - expected).largest();
            assert!(
                error < tolerance * magnitude(input),
                "{name} at {direction} is {output:?}, expected {expected} within {:.1e}",
                tolerance * magnitude(input)
            );
        }
    }
    check::<4>("sh1_evaluate", 10_000);
    check::<9>("sh2_evaluate", 10_000);
}

/// Adds weighted · Yⱼ to what was there: one product and one sum beside the basis's error.
#[test]
fn accumulation_adds_the_weighted_basis() {
    fn check<const N: usize>(name: &str)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(N as u64 + 100);
        let directions = directions(10_000, 4);
        let inputs: Vec<[Slot; 2]> = directions
            .iter()
            .map(|d| {
                let [value] = coefficients::<1>(&mut random);
                [[d.x, d.y, d.z, 0.0], value]
            })
            .collect();
        let outputs: Vec<[Slot; N]> = map(
            &format!(
                "#import lucerna::sh::project::{name}
                alias Input = array<vec4<f32>, 2>;
                alias Output = array<vec4<f32>, {N}>;
                fn map(input: Input) -> Output {{
                    var c: array<vec3<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ c[i] = vec3<f32>(f32(i), 1.0, -0.5); }}
                    {name}(&c, input[0].xyz, input[1].xyz);
                    var out: array<vec4<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ out[i] = vec4<f32>(c[i], 0.0); }}
                    return out;
                }}"
            ),
            &inputs,
        );
        for (input, output) in inputs.iter().zip(&outputs) {
            let values = all_y(N, vector(input[0]));
            for (ix, y) in values.into_iter().enumerate() {
                let start = DVec3::new(ix as f64, 1.0, -0.5);
                let expected = start + vector(input[1]) * y;
                let error = (vector(output[ix]) - expected).largest();
                let tolerance = 2e-6 + 6e-8 * expected.largest();
                assert!(
                    error < tolerance,
                    "{name} of {input:?}: coefficient {ix} is {:?}, expected {expected} within {tolerance:.1e}",
                    output[ix]
                );
            }
        }
    }
    check::<4>("sh1_accumulate");
    check::<9>("sh2_accumulate");
}

/// Projection of a function of order 1 or 2 gives its coefficients back. The 12 corners of an icosahedron
/// are a spherical 5-design: uniform weights 4π/12 integrate products of two such functions exactly.
/// Tolerance: 12 terms, each of the evaluation's error, and the weights sum to 4π: 4π · 1.1 · 3e-6.
#[test]
fn projection_gives_the_coefficients_back() {
    fn check<const N: usize>(order: usize)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(order as u64 + 7);
        let inputs: Vec<[Slot; N]> = (0..10_000).map(|_| coefficients(&mut random)).collect();
        let outputs: Vec<[Slot; N]> = map(
            &format!(
                "#import lucerna::sh::project::{{sh{order}_accumulate, sh_uniform_weight}}
                #import lucerna::sh::evaluate::sh{order}_evaluate
                alias Input = array<vec4<f32>, {N}>;
                alias Output = array<vec4<f32>, {N}>;
                fn map(input: Input) -> Output {{
                    var slots = input;
                    var c: array<vec3<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ c[i] = slots[i].xyz; }}
                    var projected: array<vec3<f32>, {N}>;
                    for (var i = 0u; i < 12u; i++) {{
                        let short = select(-1.0, 1.0, (i & 1u) == 0u);
                        let long = select(-1.618033988749895, 1.618033988749895, (i & 2u) == 0u);
                        var corner = vec3<f32>(0.0, short, long);
                        if i >= 8u {{ corner = corner.yzx; }} else if i >= 4u {{ corner = corner.zxy; }}
                        let direction = normalize(corner);
                        let value = sh{order}_evaluate(c, direction);
                        sh{order}_accumulate(&projected, direction, sh_uniform_weight(12u) * value);
                    }}
                    var out: array<vec4<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ out[i] = vec4<f32>(projected[i], 0.0); }}
                    return out;
                }}"
            ),
            &inputs,
        );
        let mut worst = 0.0f64;
        for (input, output) in inputs.iter().zip(&outputs) {
            for ix in 0..N {
                let error = (vector(output[ix]) - vector(input[ix])).largest();
                assert!(
                    error < 4e-5,
                    "order {order}: coefficient {ix} is {:?} and comes back as {:?}, expected within 4e-5",
                    input[ix],
                    output[ix]
                );
                worst = worst.max_nan(error);
            }
        }
        eprintln!("projection of order {order}: worst error {worst:e}");
    }
    check::<4>(1);
    check::<9>(2);
}

/// Coefficients of order 7 come from a hash, alike in WGSL and in Rust, for 64 colours in a kernel's
/// input or output take software adapters a quarter of a minute to compile.
const HASHED: &str = "
    fn hash_into(c: ptr<function, array<vec3<f32>, 64>>, seed: u32) {
        for (var i = 0u; i < 192u; i++) {
            var h = (seed + i) * 2654435769u;
            h = (h ^ (h >> 15u)) * 2246822519u;
            (*c)[i / 3u][i % 3u] = f32(h >> 8u) / 8388608.0 - 1.0;
        }
    }";

fn hashed(seed: u32) -> Vec<Slot> {
    let component = |i: u32| {
        let h = seed.wrapping_add(i).wrapping_mul(2_654_435_769);
        let h = (h ^ (h >> 15)).wrapping_mul(2_246_822_519);
        (h >> 8) as f32 / 8_388_608.0 - 1.0
    };
    (0..64)
        .map(|ix| [component(3 * ix), component(3 * ix + 1), component(3 * ix + 2), 0.0])
        .collect()
}

/// Value, accumulation and convolution of order 7, one coefficient an input, all 64 in turn.
/// Tolerances as for the lower orders.
#[test]
fn order_seven_is_right() {
    let mut random = Random(70);
    let inputs: Vec<Slot> = directions(20_000, 11)
        .iter()
        .map(|d| [d.x, d.y, d.z, f32::from_bits((random.bits() >> 40) as u32)])
        .collect();
    let outputs: Vec<[Slot; 3]> = map(
        &format!(
            "#import lucerna::sh::evaluate::sh_evaluate
            #import lucerna::sh::project::sh_accumulate
            #import lucerna::sh::convolve::sh_convolve_cosine
            {HASHED}
            alias Input = vec4<u32>;
            alias Output = array<vec4<f32>, 3>;
            fn map(input: Input) -> Output {{
                let direction = bitcast<vec3<f32>>(input.xyz);
                let ix = input.w % 64u;
                var c: array<vec3<f32>, 64>;
                hash_into(&c, input.w);
                let value = sh_evaluate(&c, direction);
                sh_accumulate(&c, direction, vec3<f32>(1.0, -2.0, 0.5));
                let accumulated = c[ix];
                hash_into(&c, input.w);
                sh_convolve_cosine(&c);
                return array<vec4<f32>, 3>(vec4<f32>(value, 0.0), vec4<f32>(accumulated, 0.0), vec4<f32>(c[ix], 0.0));
            }}"
        ),
        &inputs,
    );
    let factors = cosine_factors();
    let mut worst = 0.0f64;
    for (input, [value, accumulated, convolved]) in inputs.iter().zip(&outputs) {
        let (d, seed) = (vector(*input), input[3].to_bits());
        let c = hashed(seed);
        let error = (vector(*value) - evaluate(&c, d)).largest() / magnitude(&c);
        assert!(
            error < 1e-6 + 65.0 * 6e-8,
            "sh_evaluate of {input:?} is {value:?}, expected {}: off by {error:.1e} of the magnitude, expected below {:.1e}",
            evaluate(&c, d),
            1e-6 + 65.0 * 6e-8
        );
        worst = worst.max_nan(error);
        let ix = (seed % 64) as usize;
        let (l, m) = bands(64)[ix];
        let expected = vector(c[ix]) + DVec3::new(1.0, -2.0, 0.5) * y(l, m, d);
        let error = (vector(*accumulated) - expected).largest();
        assert!(
            error < 2.0 * 1e-6 * band_max(l) + 3e-7,
            "coefficient {ix} of {input:?} is accumulated to {accumulated:?}, expected {expected} within {:.1e}",
            2.0 * 1e-6 * band_max(l) + 3e-7
        );
        let expected = vector(c[ix]) * factors[l];
        let error = (vector(*convolved) - expected).largest();
        assert!(
            error < 5e-7,
            "coefficient {ix} of {input:?} is convolved to {convolved:?}, expected {expected} within 5e-7"
        );
    }
    eprintln!("sh_evaluate: worst relative error {worst:e}");
}

/// Projection of a function of order 7 by a rule exact for degree 15 :
/// c(ix) = Σ w f Y(ix), values and basis from the GPU. The basis's error in the norm of L², of functions whose
/// norm is below √64.
#[test]
fn projection_of_order_seven_gives_the_coefficients_back() {
    let rule = sphere_rule();
    let directions: Vec<Slot> = rule.iter().map(|(d, _)| slot(*d)).collect();
    let basis = check_basis::<64>("sh_basis", &directions);
    let seeds = 0..50u32;
    let inputs: Vec<Slot> = seeds
        .clone()
        .flat_map(|seed| directions.iter().map(move |d| [d[0], d[1], d[2], f32::from_bits(seed)]))
        .collect();
    let values: Vec<Slot> = map(
        &format!(
            "#import lucerna::sh::evaluate::sh_evaluate
            {HASHED}
            alias Input = vec4<u32>;
            alias Output = vec4<f32>;
            fn map(input: Input) -> Output {{
                var c: array<vec3<f32>, 64>;
                hash_into(&c, input.w);
                return vec4<f32>(sh_evaluate(&c, bitcast<vec3<f32>>(input.xyz)), 0.0);
            }}"
        ),
        &inputs,
    );
    for (seed, values) in seeds.zip(values.chunks_exact(rule.len())) {
        let function = hashed(seed);
        for ix in 0..64 {
            let sum: DVec3 = rule
                .iter()
                .zip(values)
                .zip(&basis)
                .map(|(((_, w), value), y)| vector(*value) * f64::from(y[ix]) * *w)
                .sum();
            let error = (sum - vector(function[ix])).largest();
            assert!(
                error < 6e-5,
                "function {seed}: coefficient {ix} is projected to {sum}, expected {:?} within 6e-5",
                function[ix]
            );
        }
    }
}

/// A(l) = 2π ∫₀¹ z P(l)(z) dz, by quadrature.
fn cosine_factors() -> [f64; BANDS] {
    let rule = gauss_legendre(12);
    std::array::from_fn(|l| {
        let legendre = legendre_derivative(l, 0);
        let integrand = |z: f64| TAU * z * horner(&legendre, z);
        rule.iter().map(|(t, w)| integrand((t + 1.0) / 2.0) * w / 2.0).sum()
    })
}

/// Constants rounded to f32: 1 u of π.
#[test]
fn cosine_factors_are_the_lobe_s_integrals() {
    let inputs: Vec<u32> = (0..8).collect();
    let outputs: Vec<f32> = map(
        "#import lucerna::sh::convolve::sh_cosine_factor
        alias Input = u32;
        alias Output = f32;
        fn map(input: Input) -> Output { return sh_cosine_factor(input); }",
        &inputs,
    );
    for (l, factor) in outputs.into_iter().enumerate() {
        let expected = cosine_factors()[l];
        assert!(
            (f64::from(factor) - expected).abs() < 2e-7,
            "A({l}) is {factor}, expected {expected} within 2e-7"
        );
    }
}

/// Coefficients times A(l): one rounding of the factor, one of the product.
#[test]
fn convolution_scales_each_band() {
    fn check<const N: usize>(name: &str)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(N as u64 + 200);
        let inputs: Vec<[Slot; N]> = (0..10_000).map(|_| coefficients(&mut random)).collect();
        let outputs: Vec<[Slot; N]> = map_coefficients(
            &format!("#import lucerna::sh::convolve::{name}"),
            &format!("{name}(c)"),
            &inputs,
        );
        let factors = cosine_factors();
        let table = bands(N);
        for (input, output) in inputs.iter().zip(&outputs) {
            for ix in 0..N {
                let expected = vector(input[ix]) * factors[table[ix].0];
                let error = (vector(output[ix]) - expected).largest();
                assert!(
                    error < 5e-7,
                    "{name} of {input:?}: coefficient {ix} is {:?}, expected {expected} within 5e-7",
                    output[ix]
                );
            }
        }
    }
    check::<4>("sh1_convolve_cosine");
    check::<9>("sh2_convolve_cosine");
}

/// Runs an expression of `c`, the coefficients, `a`, `b` and `d`, the w of the slots 0–2, 3–5 and 6–8.
fn map_coefficients<const N: usize>(
    imports: &str,
    call: &str,
    inputs: &[[Slot; N]],
) -> Vec<[Slot; N]>
where
    [Slot; N]: bytemuck::Pod,
{
    map(
        &format!(
            "{imports}
            alias Input = array<vec4<f32>, {N}>;
            alias Output = array<vec4<f32>, {N}>;
            fn map(input: Input) -> Output {{
                var slots = input;
                var c: array<vec3<f32>, {N}>;
                for (var i = 0u; i < {N}u; i++) {{ c[i] = slots[i].xyz; }}
                var result = {call};
                var out: array<vec4<f32>, {N}>;
                for (var i = 0u; i < {N}u; i++) {{ out[i] = vec4<f32>(result[i], 0.0); }}
                return out;
            }}"
        ),
        inputs,
    )
}

/// Runs `sh1_…` or `sh2_…` (coefficients, direction) → RGB.
fn map_lookup<const N: usize>(path: &str, inputs: &[[Slot; N]]) -> Vec<Slot>
where
    [Slot; N]: bytemuck::Pod,
{
    let name = path.rsplit("::").next().expect("a path has a name");
    map(
        &format!(
            "#import lucerna::sh::{path}
            alias Input = array<vec4<f32>, {N}>;
            alias Output = vec4<f32>;
            fn map(input: Input) -> Output {{
                var slots = input;
                var c: array<vec3<f32>, {N}>;
                for (var i = 0u; i < {N}u; i++) {{ c[i] = slots[i].xyz; }}
                return vec4<f32>({name}(c, vec3<f32>(slots[0].w, slots[1].w, slots[2].w)), 0.0);
            }}"
        ),
        inputs,
    )
}

fn set_direction(c: &mut [Slot], d: DVec3) {
    let d = d.as_vec3();
    (c[0][3], c[1][3], c[2][3]) = (d.x, d.y, d.z);
}

fn direction_of(c: &[Slot]) -> DVec3 {
    DVec3::new(c[0][3].into(), c[1][3].into(), c[2][3].into())
}

/// Any unit vector across `n`.
fn across(n: DVec3) -> DVec3 {
    n.any_orthonormal_vector()
}

/// E(n) = ∫ L max(0, n·ω) dω by quadrature over the hemisphere (exact for these polynomials). Error of
/// the evaluation, 2e-6, times π at most; constant radiance gives πL.
#[test]
fn irradiance_is_the_integral_over_the_hemisphere() {
    fn check<const N: usize>(path: &str)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(N as u64 + 300);
        let normals = directions(10_000, 5);
        let inputs: Vec<[Slot; N]> = normals
            .iter()
            .enumerate()
            .map(|(i, n)| {
                let mut c = coefficients::<N>(&mut random);
                if i % 4 == 0 {
                    // Constant radiance in [0, 100).
                    c = [[0.0; 4]; N];
                    c[0] = slot(
                        DVec3::new(random.unit().into(), 1.0, 100.0 * f64::from(random.unit()))
                            / y(0, 0, DVec3::Z),
                    );
                }
                set_direction(&mut c, n.as_dvec3());
                c
            })
            .collect();
        let outputs = map_lookup(path, &inputs);
        let rule = gauss_legendre(4);
        let factors = cosine_factors();
        let mut worst = 0.0f64;
        for (i, (input, output)) in inputs.iter().zip(&outputs).enumerate() {
            let n = direction_of(input).normalize();
            let (t, b) = (across(n), n.cross(across(n)));
            let expected: DVec3 = if i % 4 == 0 {
                vector(input[0]) * y(0, 0, DVec3::Z) * PI
            } else if i < 2000 {
                rule.iter()
                    .flat_map(|&(u, w)| {
                        (0..8).map(move |k| ((u + 1.0) / 2.0, w / 2.0, TAU * f64::from(k) / 8.0))
                    })
                    .map(|(z, w, phi)| {
                        let sine = (1.0 - z * z).sqrt();
                        let d = (t * phi.cos() + b * phi.sin()) * sine + n * z;
                        evaluate(input, d) * (z * w * TAU / 8.0)
                    })
                    .sum()
            } else {
                // Funk and Hecke's theorem: each band by its factor.
                let mut c = *input;
                for (c, (l, _)) in c.iter_mut().zip(bands(N)) {
                    *c = c.map(|c| (f64::from(c) * factors[l]) as f32);
                }
                evaluate(&c, n)
            };
            let error = (vector(*output) - expected).largest() / magnitude(input);
            assert!(
                error < 2e-6 * PI,
                "{path} of {input:?} is {output:?}, expected {expected}: off by {error:.1e} of the magnitude, expected below {:.1e}",
                2e-6 * PI
            );
            worst = worst.max_nan(error);
        }
        eprintln!("{path}: worst relative error {worst:e}");
    }
    check::<4>("convolve::sh1_irradiance");
    check::<9>("convolve::sh2_irradiance");
}

/// What the module's header says of one distant light of irradiance 1: errors up to 25 % and 9.4 %.
#[test]
fn irradiance_of_one_light_has_the_stated_error() {
    fn worst<const N: usize>(path: &str) -> f64
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(9);
        let light = random.direction().as_dvec3();
        let values = all_y(N, light);
        let inputs: Vec<[Slot; N]> = directions(10_000, 6)
            .iter()
            .map(|n| {
                let mut c = [[0.0; 4]; N];
                for (c, y) in c.iter_mut().zip(&values) {
                    *c = slot(DVec3::splat(*y));
                }
                set_direction(&mut c, n.as_dvec3());
                c
            })
            .collect();
        let outputs = map_lookup(path, &inputs);
        let errors = inputs.iter().zip(&outputs).map(|(input, output)| {
            (f64::from(output[0]) - direction_of(input).dot(light).max(0.0)).abs()
        });
        errors.fold(0.0, f64::max_nan)
    }
    let first = worst::<4>("convolve::sh1_irradiance");
    let second = worst::<9>("convolve::sh2_irradiance");
    assert!(
        (0.24..0.2501).contains(&first),
        "the largest error of order 1's irradiance of one light is {first}, expected 0.24 to 0.2501"
    );
    assert!(
        (0.092..0.0939).contains(&second),
        "the largest error of order 2's irradiance of one light is {second}, expected 0.092 to 0.0939"
    );
}

/// Random rotations, the identity, quarter turns, and reflections (every fifth).
fn orthogonal_matrices(n: usize, seed: u64) -> Vec<DMat3> {
    let mut random = Random(seed);
    let mut out = vec![DMat3::IDENTITY, DMat3::from_diagonal(DVec3::NEG_ONE)];
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        for quarter in 1..4 {
            out.push(DMat3::from_axis_angle(axis, PI / 2.0 * f64::from(quarter)));
        }
    }
    for i in 0..n {
        let axis = random.direction().as_dvec3().normalize();
        let turn = DMat3::from_quat(DQuat::from_axis_angle(axis, TAU * f64::from(random.unit())));
        let mirror = if i % 5 == 0 { DVec3::new(-1.0, 1.0, 1.0) } else { DVec3::ONE };
        out.push(turn * DMat3::from_diagonal(mirror));
    }
    out
}

/// g(R d) = f(d), evaluated in f64: rotated coefficients are those of the rotated function. Three
/// products of matrices of 3 terms, 4 u each, on a sum of up to 9 entries, and R rounded to f32.
#[test]
fn rotation_moves_the_function() {
    fn check<const N: usize>(order: usize)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(order as u64 + 400);
        let rotations = orthogonal_matrices(10_000, 8);
        // The matrix's entries lie in the w of the slots, or beside them for order 1.
        let inputs: Vec<[Slot; 16]> = rotations
            .iter()
            .map(|r| {
                let mut slots = [[0.0; 4]; 16];
                slots[..N].copy_from_slice(&coefficients::<N>(&mut random));
                for (i, entry) in r.to_cols_array().into_iter().enumerate() {
                    slots[i][3] = entry as f32;
                }
                slots
            })
            .collect();
        let outputs: Vec<[Slot; N]> = map(
            &format!(
                "#import lucerna::sh::rotate::sh{order}_rotate
                alias Input = array<vec4<f32>, 16>;
                alias Output = array<vec4<f32>, {N}>;
                fn map(input: Input) -> Output {{
                    var slots = input;
                    var c: array<vec3<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ c[i] = slots[i].xyz; }}
                    var r: mat3x3<f32>;
                    for (var i = 0u; i < 3u; i++) {{
                        r[i] = vec3<f32>(slots[3u * i].w, slots[3u * i + 1u].w, slots[3u * i + 2u].w);
                    }}
                    var result = sh{order}_rotate(c, r);
                    var out: array<vec4<f32>, {N}>;
                    for (var i = 0u; i < {N}u; i++) {{ out[i] = vec4<f32>(result[i], 0.0); }}
                    return out;
                }}"
            ),
            &inputs,
        );
        let mut worst = 0.0f64;
        for ((input, output), r) in inputs.iter().zip(&outputs).zip(&rotations) {
            let input = &input[..N];
            for _ in 0..3 {
                let d = random.direction().as_dvec3().normalize();
                let error =
                    (evaluate(output, *r * d) - evaluate(input, d)).largest() / magnitude(input);
                assert!(
                    error < 1e-6,
                    "order {order}: the function turned by {r} is off at {d} by {error:e} of the magnitude, expected below 1e-6"
                );
                worst = worst.max_nan(error);
            }
            // Power stays in its band.
            for l in 0..=order {
                let power = |c: &[Slot]| {
                    c[l * l..(l + 1) * (l + 1)]
                        .iter()
                        .map(|&c| vector(c).length_squared())
                        .sum::<f64>()
                };
                assert!(
                    (power(output) - power(input)).abs() < 5e-6 * power(input),
                    "order {order}: the power of band {l} turned by {r} is {}, expected {} within 5e-6 of it",
                    power(output),
                    power(input)
                );
            }
        }
        // The identity is exact but for a rounding or two.
        for (ix, (before, after)) in inputs[0].iter().zip(&outputs[0]).enumerate() {
            assert!(
                (vector(*before) - vector(*after)).largest() < 5e-7,
                "order {order}: coefficient {ix} is {before:?} and turned by nothing {after:?}, expected within 5e-7"
            );
        }
        eprintln!("sh{order}_rotate: worst relative error {worst:e}");
    }
    check::<4>(1);
    check::<9>(2);
}

/// A zonal function turned to an axis: f(d) = Σ z(l) Y(l, 0) of the angle to the axis. One factor, two
/// products beside the basis's error.
#[test]
fn zonal_functions_turn_to_any_axis() {
    let mut random = Random(500);
    let inputs: Vec<[Slot; 2]> = directions(10_000, 9)
        .iter()
        .map(|d| {
            let [zonal] = coefficients::<1>(&mut random);
            [[d.x, d.y, d.z, 0.0], zonal]
        })
        .collect();
    let outputs: Vec<[f32; 16]> = map(
        "#import lucerna::sh::rotate::{sh1_from_zonal, sh2_from_zonal}
        alias Input = array<vec4<f32>, 2>;
        alias Output = array<f32, 16>;
        fn map(input: Input) -> Output {
            var first = sh1_from_zonal(input[1].xy, input[0].xyz);
            var second = sh2_from_zonal(input[1].xyz, input[0].xyz);
            var out: array<f32, 16>;
            for (var i = 0u; i < 4u; i++) { out[i] = first[i]; }
            for (var i = 0u; i < 9u; i++) { out[4u + i] = second[i]; }
            return out;
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let (axis, zonal) = (vector(input[0]).normalize(), vector(input[1]).to_array());
        for (coefficients, order) in [(&output[..4], 1), (&output[4..13], 2)] {
            let d = random.direction().as_dvec3().normalize();
            let cosine = d.dot(axis);
            let tilted = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
            let expected: f64 = (0..=order).map(|l| zonal[l] * y(l, 0, tilted)).sum();
            let value: f64 =
                coefficients.iter().zip(all_y(9, d)).map(|(&c, y)| f64::from(c) * y).sum();
            assert!(
                (value - expected).abs() < 4e-6,
                "order {order}: the zonal function {zonal:?} about {axis} is {value} at {d}, expected {expected} within 4e-6"
            );
        }
    }
}

/// The published formulas. cos and sin are right to 2⁻¹¹ absolute over [−π, π] by WGSL's own bound,
/// which says nothing; the asserted 2e-6 is what polynomials in f32 give, plus the quotient's.
#[test]
fn windows_follow_their_formulas() {
    let mut random = Random(600);
    let mut inputs: Vec<[f32; 2]> = Vec::new();
    for l in 0..8u8 {
        for width in [0.5f32, 1.0, 2.0, 3.0, 4.0, 8.0, 100.0] {
            inputs.push([f32::from(l), width]);
        }
    }
    inputs.extend((0..10_000).map(|i| [(i % 8) as f32, random.range(0.1, 20.0)]));
    let outputs: Vec<[f32; 3]> = map(
        "#import lucerna::sh::window::{sh_window_hann, sh_window_lanczos, sh_window_laplacian}
        alias Input = vec2<f32>;
        struct Output { hann: f32, lanczos: f32, laplacian: f32 }
        fn map(input: Input) -> Output {
            let l = u32(input.x);
            return Output(sh_window_hann(l, input.y), sh_window_lanczos(l, input.y), sh_window_laplacian(l, input.y));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let (l, w) = (f64::from(input[0]), f64::from(input[1]));
        let x = PI * l / w;
        let hann = if l < w { (1.0 + x.cos()) / 2.0 } else { 0.0 };
        let lanczos = if l == 0.0 {
            1.0
        } else if l < w {
            x.sin() / x
        } else {
            0.0
        };
        let laplacian = 1.0 / (1.0 + w * l * l * (l + 1.0) * (l + 1.0));
        // Sines and cosines of GPUs are right to 2⁻²¹ in [−π, π] (NVIDIA's documented error; WGSL allows 2⁻¹¹).
        let trigonometric = 2f64.powi(-21);
        let of_lanczos = if l == 0.0 { 0.0 } else { trigonometric / x };
        let tolerances = [trigonometric, of_lanczos, 0.0].map(|more| 2e-6 + more);
        let values = output.iter().zip([hann, lanczos, laplacian]).zip(tolerances);
        let names = ["Hann", "Lanczos", "Laplacian"];
        for (name, ((value, expected), tolerance)) in names.iter().zip(values) {
            assert!(
                (f64::from(*value) - expected).abs() < tolerance,
                "{name}'s window of band {l}, width {w}, is {value}, expected {expected} within {tolerance:.1e}"
            );
        }
        if l == 0.0 {
            assert_eq!(*output, [1.0; 3], "windows of band 0, width {w}: the mean is kept");
        }
    }
}

/// One product each, exactly rounded.
#[test]
fn windows_scale_each_band() {
    fn check<const N: usize>(call: &str)
    where
        [Slot; N]: bytemuck::Pod,
    {
        let mut random = Random(N as u64 + 700);
        let inputs: Vec<[Slot; N]> = (0..10_000)
            .map(|_| {
                let mut c = coefficients::<N>(&mut random);
                set_direction(
                    &mut c,
                    DVec3::new(random.unit().into(), random.unit().into(), random.unit().into()),
                );
                c
            })
            .collect();
        let outputs = map_coefficients(
            "#import lucerna::sh::window::{sh1_window, sh2_window}",
            call,
            &inputs,
        );
        for (input, output) in inputs.iter().zip(&outputs) {
            for (ix, (l, _)) in bands(N).into_iter().enumerate() {
                let factor = input[l][3];
                let expected = [0, 1, 2].map(|axis| input[ix][axis] * factor);
                assert_eq!(output[ix][..3], expected, "{call}: coefficient {ix} times {factor}");
            }
        }
    }
    check::<4>("sh1_window(c, vec2<f32>(slots[0].w, slots[1].w))");
    check::<9>("sh2_window(c, vec3<f32>(slots[0].w, slots[1].w, slots[2].w))");
}

/// A light from one direction over constant light is found again, its direction to 1e-6 rad times the
/// coefficients' rounding (12 u) over their length, its irradiance to 1e-5 of it; two lights give the
/// direction of the sum weighted by luminance; no light gives the fallback.
#[test]
fn dominant_light_is_found() {
    let mut random = Random(800);
    let weights = DVec3::new(0.2126, 0.7152, 0.0722);
    let mut lights: Vec<[(DVec3, DVec3); 2]> = Vec::new();
    for d in directions(10_000, 10) {
        let d = d.as_dvec3().normalize();
        let [colour, other] = coefficients::<2>(&mut random).map(|c| vector(c).abs() + 0.01);
        let other = if lights.len().is_multiple_of(2) { DVec3::ZERO } else { other };
        lights.push([(d, colour), (random.direction().as_dvec3().normalize(), other)]);
    }
    let inputs: Vec<[Slot; 9]> = lights
        .iter()
        .map(|pair| {
            let mut c = [[0.0; 4]; 9];
            for (ix, c) in c.iter_mut().enumerate() {
                *c = slot(pair.iter().map(|&(d, e)| e * all_y(9, d)[ix]).sum());
            }
            set_direction(&mut c, pair[0].0);
            c
        })
        .chain([[[0.0; 4]; 9]])
        .collect();
    let outputs: Vec<[Slot; 4]> = map(
        "#import lucerna::sh::dominant::{sh1_dominant_direction, sh2_dominant_direction, sh1_directional_light, sh2_directional_light}
        alias Input = array<vec4<f32>, 9>;
        alias Output = array<vec4<f32>, 4>;
        fn map(input: Input) -> Output {
            var slots = input;
            var c: array<vec3<f32>, 9>;
            for (var i = 0u; i < 9u; i++) { c[i] = slots[i].xyz; }
            let linear = array<vec3<f32>, 4>(c[0], c[1], c[2], c[3]);
            let d = vec3<f32>(slots[0].w, slots[1].w, slots[2].w);
            let fallback = vec3<f32>(3.0, 4.0, 5.0);
            return array<vec4<f32>, 4>(
                vec4<f32>(sh1_dominant_direction(linear, fallback), 0.0),
                vec4<f32>(sh2_dominant_direction(c, fallback), 0.0),
                vec4<f32>(sh1_directional_light(linear, d), 0.0),
                vec4<f32>(sh2_directional_light(c, d), 0.0),
            );
        }",
        &inputs,
    );
    for ((input, output), pair) in inputs.iter().zip(&outputs).zip(&lights) {
        let sum: DVec3 = pair.iter().map(|&(d, e)| d * e.dot(weights)).sum();
        let total: f64 = pair.iter().map(|&(_, e)| e.dot(weights)).sum();
        for direction in &output[..2] {
            let error = (vector(*direction) - sum.normalize()).length();
            assert!(
                error < 1e-6 * total / sum.length(),
                "dominant direction of {pair:?} is {direction:?}, expected {} within {:.1e}",
                sum.normalize(),
                1e-6 * total / sum.length()
            );
        }
        // Least squares: the fit's residual is orthogonal to the light's projection.
        for (light, n) in [(output[2], 4), (output[3], 9)] {
            let basis = all_y(n, direction_of(input));
            let residual: DVec3 =
                basis.iter().zip(input).map(|(&y, &c)| (vector(c) - vector(light) * y) * y).sum();
            assert!(
                residual.largest() < 5e-6,
                "{n} coefficients, light of {pair:?} is {light:?}, the fit's residual {residual}, expected below 5e-6"
            );
            if pair[1].1 == DVec3::ZERO {
                let error = (vector(light) - pair[0].1).largest();
                assert!(
                    error < 1e-5,
                    "{n} coefficients, light of {pair:?} is {light:?}, expected {} within 1e-5",
                    pair[0].1
                );
            }
        }
    }
    let dark = outputs.last().expect("not empty");
    assert_eq!(
        dark[..2],
        [[3.0, 4.0, 5.0, 0.0]; 2],
        "dominant directions without light, expected the fallback"
    );
    assert_eq!(dark[2..], [[0.0; 4]; 2], "directional lights without light");
}

/// Legendre polynomial P_l.
fn legendre(l: usize, x: f64) -> f64 {
    match l {
        0 => 1.0,
        1 => x,
        _ => {
            let n = l as f64;
            ((2.0 * n - 1.0) * x * legendre(l - 1, x) - (n - 1.0) * legendre(l - 2, x)) / n
        }
    }
}

/// Factors of the normalised lobe exp(κ(cosθ − 1)) are its means of the Legendre polynomials (Funk and Hecke), here by Gauss's rule on the part of the sphere
/// that matters. And the mean of a step: Σ a_l h_l P_l(cosine) with h_l = (2l + 1)/2 ∫₀¹ P_l. Tolerance: 1e-3, as documented, where the recurrence cancels.
#[test]
fn lobes_scale_each_band() {
    let mut random = Random(77);
    let mut inputs: Vec<[f32; 4]> =
        [0.5f32, 0.7, 1.0, 2.0, 4.0, 10.0, 60.0, 900.0].map(|k| [k, 0.3, 4.0, 0.0]).to_vec();
    inputs.extend((0..200).map(|ix| {
        let sharpness = 0.5 * (8.0 * random.unit()).exp();
        [sharpness, 2.0 * random.unit() - 1.0, (ix % 5) as f32, 0.0]
    }));
    let found: Vec<[f32; 8]> = map(
        "#import lucerna::sh::lobe::{sh_lobe_above, sh_lobe_factors}
         alias Input = vec4<f32>;
         alias Output = array<f32, 8>;
         fn map(x: Input) -> Output {
             let a = sh_lobe_factors(x.x);
             var f = a;
             return Output(f[0], f[1], f[2], f[3], f[4], sh_lobe_above(a, x.y, u32(x.z)), 0.0, 0.0);
         }",
        &inputs,
    );
    let rule = gauss_legendre(200);
    for (input, found) in inputs.iter().zip(&found) {
        let [k, cosine, last, _] = input.map(f64::from);
        // cosθ = 1 − s/κ: all but e⁻⁴⁰ of the lobe is at s below 40.
        let most = (2.0 * k).min(40.0);
        let mean = |f: &dyn Fn(f64) -> f64| {
            let sum = |g: &dyn Fn(f64) -> f64| {
                rule.iter()
                    .map(|(x, w)| {
                        let s = 0.5 * most * (x + 1.0);
                        w * (-s).exp() * g(1.0 - s / k)
                    })
                    .sum::<f64>()
            };
            sum(f) / sum(&|_| 1.0)
        };
        let mut above = 0.0;
        for (l, found) in found.iter().take(5).enumerate() {
            let a = mean(&|x| legendre(l, x));
            assert!(
                (f64::from(*found) - a).abs() < 1e-3,
                "band {l} of sharpness {k}: {found}, expected {a}"
            );
            let step: f64 = rule.iter().map(|(x, w)| 0.5 * w * legendre(l, 0.5 * (x + 1.0))).sum();
            if l as f64 <= last {
                above += a * (l as f64 + 0.5) * step * legendre(l, cosine);
            }
        }
        assert!(
            (f64::from(found[5]) - above).abs() < 2e-3,
            "step of bands up to {last} at {cosine}, sharpness {k}: {}, expected {above}",
            found[5]
        );
    }
}
