// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/bsdf`.

use crate::harness::{KeepNan, Largest, Random, assert_each, gpu, map, normal_limit};
use crate::sampling::{unit_corners, unit_inputs};
use crate::statistics::{Chart, assert_chi_square};
use glam::{DVec3, Vec3, Vec4};
use std::f64::consts::{FRAC_1_PI, PI};

const MIN_ALPHA: f64 = 1e-3;

/// glTF 2.0 appendix B in f64, from the specification's own formulas: N·H, N·L, N·V. The diffuse
/// weight is that of its B.3.6.3: (1 − F(N·L))·(1 − F(N·V)).
#[derive(Clone, Copy, Debug)]
pub struct Material {
    base: DVec3,
    metallic: f64,
    alpha: f64,
}

impl Material {
    pub fn new(base: Vec3, metallic: f32, roughness: f32) -> Self {
        let alpha = (f64::from(roughness) * f64::from(roughness)).max(MIN_ALPHA);
        Self { base: base.as_dvec3(), metallic: f64::from(metallic), alpha }
    }

    fn fresnel(&self, cosine: f64) -> DVec3 {
        let f0 = DVec3::splat(0.04).lerp(self.base, self.metallic);
        f0 + (1.0 - f0) * (1.0 - cosine).max(0.0).powi(5)
    }

    fn diffuse(&self) -> DVec3 {
        self.base.lerp(DVec3::ZERO, self.metallic)
    }

    fn d(&self, h: DVec3) -> f64 {
        // (N·H)²(α² − 1) + 1 without its cancellation.
        let (a, n_h) = (self.alpha * self.alpha, h.z);
        let sin_square = h.x * h.x + h.y * h.y;
        if n_h <= 0.0 { 0.0 } else { a / (PI * (n_h * n_h * a + sin_square).powi(2)) }
    }

    fn v(&self, wo: DVec3, wi: DVec3) -> f64 {
        let a = self.alpha * self.alpha;
        let (n_l, n_v) = (wi.z, wo.z);
        0.5 / (n_l * (n_v * n_v * (1.0 - a) + a).sqrt() + n_v * (n_l * n_l * (1.0 - a) + a).sqrt())
    }

    /// f and D·V.
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let h = (wo + wi).normalize();
        let transmitted = (1.0 - self.fresnel(wi.z)) * (1.0 - self.fresnel(wo.z));
        let specular = self.d(h) * self.v(wo, wi);
        let diffuse = transmitted * self.diffuse() * FRAC_1_PI;
        (diffuse + self.fresnel(wo.dot(h)) * specular, specular)
    }

    /// ∫ f·cos dωᵢ term by term, each by the rule that suits it: the diffuse one by midpoints in
    /// cos², the specular one by `n`² midpoints over the visible normals (E. Heitz, "Sampling the GGX
    /// Distribution of Visible Normals", JCGT 7(4), 2018), over which it is smooth for every α.
    pub fn albedo(&self, wo: DVec3, n: usize) -> DVec3 {
        let midpoint = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let mut diffuse = DVec3::ZERO;
        for i in 0..1000 {
            diffuse += (1.0 - self.fresnel(midpoint(i, 1000).sqrt())) / 1000.0;
        }
        diffuse *= (1.0 - self.fresnel(wo.z)) * self.diffuse();

        let stretched = DVec3::new(self.alpha * wo.x, self.alpha * wo.y, wo.z).normalize();
        let side = DVec3::Z.cross(stretched).try_normalize().unwrap_or(DVec3::X);
        let other = stretched.cross(side);
        let mut specular = DVec3::ZERO;
        for i in 0..n * n {
            // Midpoints in z = √(1 − r²): weights fall off steeply where it is small.
            let (z, phi) = (midpoint(i % n, n), 2.0 * PI * midpoint(i / n, n));
            let r = (1.0 - z * z).sqrt();
            let (t1, s) = (r * phi.cos(), 0.5 * (1.0 + stretched.z));
            let t2 = (1.0 - s) * (1.0 - t1 * t1).max(0.0).sqrt() + s * r * phi.sin();
            let t3 = (1.0 - t1 * t1 - t2 * t2).max(0.0).sqrt();
            let h = t1 * side + t2 * other + t3 * stretched;
            let h = DVec3::new(self.alpha * h.x, self.alpha * h.y, h.z.max(0.0)).normalize();
            let wi = 2.0 * wo.dot(h) * h - wo;
            if wi.z > 0.0 {
                let lobe = self.d(h) * self.v(wo, wi) * wi.z;
                specular += 2.0 * z * self.fresnel(wo.dot(h)) * lobe / self.visible_about(wo, h);
            }
        }
        diffuse + specular / (n * n) as f64
    }

    fn specular_probability(&self, wo: DVec3) -> f64 {
        let fresnel = self.fresnel(wo.z);
        let specular = fresnel.element_sum();
        // 2∫(1 − F(x))·x dx = (1 − f₀)·20/21.
        let mean = (1.0 - self.fresnel(1.0)) * 20.0 / 21.0;
        let diffuse = ((1.0 - fresnel) * mean * self.diffuse()).element_sum();
        if diffuse == 0.0 { 1.0 } else { (specular / (specular + diffuse)).clamp(0.1, 0.9) }
    }

    /// Visible normals (Heitz 2018): G₁·max(0, wo·h)·D/cos_o, times dh/dwi = 1/(4·wo·h).
    fn visible(&self, wo: DVec3, wi: DVec3) -> f64 {
        self.visible_about(wo, (wo + wi).normalize())
    }

    fn visible_about(&self, wo: DVec3, h: DVec3) -> f64 {
        let tan_square = (1.0 - wo.z * wo.z).max(0.0) / (wo.z * wo.z);
        let lambda = ((1.0 + self.alpha * self.alpha * tan_square).sqrt() - 1.0) / 2.0;
        self.d(h) / (1.0 + lambda) / (4.0 * wo.z)
    }

    fn pdf(&self, wo: DVec3, wi: DVec3) -> f64 {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return 0.0;
        }
        let p = self.specular_probability(wo);
        p * self.visible(wo, wi) + (1.0 - p) * wi.z * FRAC_1_PI
    }
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Input {
    base: Vec3,
    metallic: f32,
    wo: Vec3,
    roughness: f32,
    /// wi, or u.
    wi: Vec3,
    pad: f32,
}

impl Input {
    fn material(&self) -> Material {
        Material::new(self.base, self.metallic, self.roughness)
    }
}

fn upper(d: Vec3) -> Vec3 {
    Vec3::new(d.x, d.y, d.z.abs())
}

/// Seeded materials and pairs of directions, half of them near the mirror, and edge cases.
fn pairs() -> Vec<Input> {
    let mut random = Random(31);
    let mut out = Vec::new();
    for i in 0..30_000 {
        let base = Vec3::new(random.unit(), random.unit(), random.unit());
        let (wo, mut wi) = (upper(random.direction()), upper(random.direction()));
        let roughness = random.unit();
        if i % 2 == 0 {
            let spread = roughness.powi(2).max(1e-3) * random.range(0.0, 3.0);
            let mirror = Vec3::new(-wo.x, -wo.y, wo.z) + random.direction() * spread;
            wi = upper(mirror.as_dvec3().normalize().as_vec3());
        }
        let metallic = [0.0, 1.0, random.unit()][i % 3];
        out.push(Input { base, metallic, wo, roughness, wi, pad: 0.0 });
    }
    for roughness in [0.0, 0.1, 1.0] {
        for metallic in [0.0, 1.0] {
            for base in [Vec3::ZERO, Vec3::ONE] {
                for theta in [0.0f64, 0.8, 1.5, 1.5705, 1.570_795] {
                    for side in [-1.0, 1.0] {
                        let wo = DVec3::new(theta.sin(), 0.0, theta.cos()).as_vec3();
                        let wi = Vec3::new(side * wo.x, 0.0, wo.z);
                        out.push(Input { base, metallic, wo, roughness, wi, pad: 0.0 });
                    }
                }
            }
        }
    }
    out
}

const IMPORTS: &str = "
    #import lucerna::bsdf::metallic_roughness::{metallic_roughness, evaluate_metallic_roughness, pdf_metallic_roughness, sample_metallic_roughness}
    struct Input { base: vec3<f32>, metallic: f32, wo: vec3<f32>, roughness: f32, wi: vec3<f32>, pad: f32 }
";

/// f and pdf of both orders of directions.
fn evaluate(inputs: &[Input]) -> Vec<[Vec4; 2]> {
    map(
        &format!(
            "{IMPORTS}
            struct Output {{ there: vec4<f32>, back: vec4<f32> }}
            fn map(input: Input) -> Output {{
                let m = metallic_roughness(input.base, input.metallic, input.roughness);
                var out: Output;
                for (var i = 0; i < 2; i++) {{
                    let wo = select(input.wo, input.wi, i == 1);
                    let wi = select(input.wi, input.wo, i == 1);
                    let value = vec4<f32>(evaluate_metallic_roughness(m, wo, wi), pdf_metallic_roughness(m, wo, wi));
                    if i == 0 {{ out.there = value; }} else {{ out.back = value; }}
                }}
                return out;
            }}"
        ),
        inputs,
    )
}

/// Draws: direction and pdf, weight.
fn sample(inputs: &[Input]) -> Vec<[Vec4; 2]> {
    map(
        &format!(
            "{IMPORTS}
            struct Output {{ direction: vec4<f32>, weight: vec4<f32> }}
            fn map(input: Input) -> Output {{
                let m = metallic_roughness(input.base, input.metallic, input.roughness);
                let s = sample_metallic_roughness(m, input.wo, input.wi);
                return Output(vec4<f32>(s.direction, s.pdf), vec4<f32>(s.weight, 0.0));
            }}"
        ),
        inputs,
    )
}

/// Relative error of D: the half vector's rounding, 3e-7 over |wo + wi|, against the lobe's width
/// (d ln D/dθ ≤ 2/α); 20 roundings elsewhere.
fn lobe_tolerance(alpha: f64, wo: Vec3, wi: Vec3) -> f64 {
    2e-6 + 6e-7 / (alpha * (wo.as_dvec3() + wi.as_dvec3()).length())
}

/// The specification in f64 at 30 000 random and some extreme configurations; both orders of the
/// directions agree. Fresnel's (1 − cos)⁵ is known to 1e-6 absolute.
#[test]
fn metallic_roughness_matches_the_specification_and_is_reciprocal() {
    let inputs = pairs();
    for (input, [there, back]) in inputs.iter().zip(evaluate(&inputs)) {
        let (m, wo, wi) = (input.material(), input.wo.as_dvec3(), input.wi.as_dvec3());
        let (expected, lobe) = m.evaluate(wo, wi);
        let tolerance = lobe_tolerance(m.alpha, input.wo, input.wi);
        let what = format!("{m:?}, wo {wo}, wi {wi}");
        for lane in 0..3 {
            let bound = tolerance * expected[lane] + 1e-6 * (lobe + 1.0);
            assert!(
                (f64::from(there[lane]) - expected[lane]).abs() <= bound,
                "{what}: f is {there}, expected {expected} within {bound:.1e} in lane {lane}"
            );
            assert!(
                (there[lane] - back[lane]).abs() as f64 <= bound,
                "{what}: f with directions exchanged is {back}, expected {there} within {bound:.1e} in lane {lane}"
            );
        }
        let pdf = m.pdf(wo, wi);
        assert!(
            (f64::from(there.w) - pdf).abs() <= tolerance * pdf + 1e-6,
            "{what}: the pdf is {}, expected {pdf} within {tolerance:.1e} of it and 1e-6",
            there.w
        );
    }
}

/// Nothing below or along the surface, and finite values where the directions cancel.
#[test]
fn metallic_roughness_is_black_below_and_finite_at_the_horizon() {
    let mut inputs = Vec::new();
    let up = Vec3::new(0.6, 0.0, 0.8);
    for wo in [up, -up, Vec3::X, Vec3::new(1.0, 0.0, 1e-30), Vec3::new(1.0, 0.0, 1e-38)] {
        for wi in [up, -up, Vec3::NEG_X, Vec3::new(-1.0, 0.0, 1e-30), Vec3::new(1.0, 0.0, 1e-38)] {
            for roughness in [-1.0, 0.0, 1.0, 7.0] {
                inputs.push(Input { base: Vec3::ONE, metallic: 0.5, wo, roughness, wi, pad: 0.0 });
            }
        }
    }
    let drawn = sample(&inputs);
    for ((input, values), [direction, weight]) in inputs.iter().zip(evaluate(&inputs)).zip(drawn) {
        let what = format!("roughness {}, wo {}, wi {}", input.roughness, input.wo, input.wi);
        for value in values {
            assert!(
                value.is_finite() && value.cmpge(Vec4::ZERO).all(),
                "{what}: f and pdf are {value}, expected finite and at least 0"
            );
            if input.wo.z <= 0.0 || input.wi.z <= 0.0 {
                assert_eq!(value, Vec4::ZERO, "{what}: f and pdf below the surface");
            }
        }
        assert!(
            direction.is_finite() && weight.is_finite(),
            "{what} as u: drawn are the direction and pdf {direction} and the weight {weight}, expected finite"
        );
        if input.wo.z <= 0.0 {
            assert_eq!(
                (direction.w, weight),
                (0.0, Vec4::ZERO),
                "{what} as u: pdf and weight drawn below the surface"
            );
        }
    }
}

fn direction_at(theta: f64) -> Vec3 {
    DVec3::new(theta.sin() * 0.8, theta.sin() * 0.6, theta.cos()).as_vec3()
}

fn mirrored(wo: Vec3) -> DVec3 {
    DVec3::new(-f64::from(wo.x), -f64::from(wo.y), f64::from(wo.z))
}

const ROUGHNESSES: [f32; 12] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0];

/// The model in f64 never reflects more than all: 12 roughnesses (the first is the least α), 8
/// metallic factors, 3 greys, 0° to 88° by 2° and closer to the horizon. The quadrature's own error,
/// up to 6e-4, gets no allowance: white metals sum weights of at most 1, and all others stay below.
#[test]
fn metallic_roughness_conserves_energy_in_f64() {
    let mut worst = (0.0, String::new());
    let mut worst_mixed = (0.0, String::new());
    for roughness in ROUGHNESSES {
        for metallic in [0.0f32, 0.02, 0.1, 0.3, 0.5, 0.8, 0.99, 1.0] {
            let m = Material::new(Vec3::new(1.0, 0.9, 0.5), metallic, roughness);
            let angles = (0..45).map(|i| 2.0 * f64::from(i)).chain([89.0, 89.5, 89.9, 89.999]);
            for degrees in angles {
                let (sin, cos) = f64::sin_cos(degrees.to_radians());
                let albedo = m.albedo(DVec3::new(0.8 * sin, 0.6 * sin, cos), 60);
                let what = format!("roughness {roughness}, metallic {metallic}, {degrees}°");
                assert!(
                    albedo.max_element() <= 1.0 + 1e-12,
                    "{what}: albedo in f64 is {albedo}, expected at most 1 + 1e-12"
                );
                let worst = if metallic <= 0.5 { &mut worst_mixed } else { &mut worst };
                if albedo.max_element() > worst.0 {
                    *worst = (albedo.max_element(), what);
                }
            }
        }
    }
    eprintln!("largest albedo: {worst:?}; up to metallic 0.5: {worst_mixed:?}");
}

/// The kernel's mean weight over its own draws, 4096 Hammersley points for either lobe,
/// is the albedo in f64, for white materials, every roughness and 1° to 90° above the surface; and
/// it is at most 1 (but for rounding: 2e-6).
#[test]
fn metallic_roughness_sampler_conserves_energy() {
    const N: u32 = 4096;
    let mut worst = (0.0f64, String::new());
    let mut error = 0.0f64;
    for roughness in ROUGHNESSES {
        let mut inputs = Vec::new();
        let mut configurations = Vec::new();
        for metallic in [0.0f32, 0.1, 0.5, 0.9, 1.0] {
            for degrees in [0.0f64, 20.0, 45.0, 60.0, 70.0, 75.0, 80.0, 85.0, 88.0, 89.0] {
                let wo = direction_at(degrees.to_radians());
                configurations.push((metallic, degrees, wo));
                for lobe in [0.0, 1.0 - f32::EPSILON] {
                    for i in 0..N {
                        let inverse = (i.reverse_bits() >> 8) as f32 / 16_777_216.0;
                        let wi = Vec3::new((i as f32 + 0.5) / N as f32, inverse, lobe);
                        inputs.push(Input {
                            base: Vec3::ONE,
                            metallic,
                            wo,
                            roughness,
                            wi,
                            pad: 0.0,
                        });
                    }
                }
            }
        }
        let outputs = sample(&inputs);
        for (chunk, (metallic, degrees, wo)) in configurations.into_iter().enumerate() {
            let m = Material::new(Vec3::ONE, metallic, roughness);
            let mean = |half: usize| {
                let from = (2 * chunk + half) * N as usize;
                let weights = outputs[from..from + N as usize].iter().map(|o| f64::from(o[1].x));
                weights.sum::<f64>() / f64::from(N)
            };
            let p = m.specular_probability(wo.as_dvec3());
            let albedo = p * mean(0) + (1.0 - p) * mean(1);
            let expected = m.albedo(wo.as_dvec3(), 100).x;
            let what = format!("roughness {roughness}, metallic {metallic}, {degrees}°");
            assert!(
                albedo <= 1.0 + 2e-6,
                "{what}: mean weight of draws is {albedo}, expected at most 1 + 2e-6"
            );
            assert!(
                (albedo - expected).abs() < 1e-3,
                "{what}: mean weight of draws is {albedo}, expected the albedo {expected} within 1e-3"
            );
            error = error.max_nan((albedo - expected).abs());
            if albedo > worst.0 {
                worst = (albedo, what);
            }
        }
    }
    eprintln!("largest albedo: {worst:?}; largest error {error:.1e}");
}

/// Albedos of white materials by quadrature of the kernel's f·cos, 96 × 96 points about the mirror
/// direction (the lobe's error by this rule is below 3e-3), whatever the sampler does: those in f64,
/// and so at most 1.
#[test]
fn white_furnace_matches_the_albedo() {
    let mut inputs = Vec::new();
    let mut configurations = Vec::new();
    let mut weights = Vec::new();
    for roughness in [0.05f32, 0.2, 0.4, 0.6, 0.8, 1.0] {
        for metallic in [0.0f32, 0.5, 1.0] {
            for degrees in [0.0f64, 45.0, 60.0, 75.0, 85.0, 89.0] {
                let wo = direction_at(degrees.to_radians());
                if roughness * roughness * wo.z < 1e-4 {
                    // The lobe slips between the nodes.
                    continue;
                }
                let nodes = Chart::about(mirrored(wo), 4.0, [1, 1]).nodes(96, 96);
                configurations.push((roughness, metallic, degrees, wo));
                for (wi, weight) in nodes {
                    let (base, wi) = (Vec3::ONE, wi.as_vec3());
                    inputs.push(Input { base, metallic, wo, roughness, wi, pad: 0.0 });
                    weights.push(weight * f64::from(wi.z.max(0.0)));
                }
            }
        }
    }
    let outputs = evaluate(&inputs);
    let mut worst = [0.0f64; 2];
    for (chunk, &(roughness, metallic, degrees, wo)) in configurations.iter().enumerate() {
        let range = chunk * 96 * 96..(chunk + 1) * 96 * 96;
        let albedo: f64 = outputs[range.clone()]
            .iter()
            .zip(&weights[range])
            .map(|(o, w)| f64::from(o[0].x) * w)
            .sum();
        let expected = Material::new(Vec3::ONE, metallic, roughness).albedo(wo.as_dvec3(), 100).x;
        let what = format!("roughness {roughness}, metallic {metallic}, {degrees}°");
        assert!(
            (albedo - expected).abs() < 3e-3,
            "{what}: albedo by quadrature is {albedo:.4}, expected {expected:.4} within 3e-3"
        );
        worst = [worst[0].max_nan(albedo), worst[1].max_nan((albedo - expected).abs())];
    }
    eprintln!("largest albedo {:.4}, largest error {:.1e}", worst[0], worst[1]);
}

fn sampling_cases() -> Vec<(Vec3, f32, f32, f64)> {
    let colour = Vec3::new(0.9, 0.5, 0.1);
    vec![
        (colour, 0.0, 1.0, 0.3),
        (colour, 0.0, 0.5, 1.2),
        (colour, 0.0, 0.2, 1.5),
        (Vec3::ONE, 0.0, 0.15, 1.4),
        (Vec3::ONE, 0.2, 0.9, 1.55),
        (colour, 0.5, 0.7, 0.8),
        (colour, 1.0, 1.0, 1.4),
        (colour, 1.0, 0.6, 0.0),
        (colour, 1.0, 0.3, 1.0),
        (colour, 1.0, 0.1, 1.35),
        (Vec3::ZERO, 0.0, 0.8, 1.0),
        (Vec3::ONE, 1.0, 0.0, 0.7),
    ]
}

/// Chi-square of the directions against the density in f64 (failed draws are one more bin), for 12
/// materials; every draw's pdf and weight = f·cos/pdf against f64; the mean weight is the albedo by
/// quadrature within their standard errors, at the suite's level.
#[test]
fn metallic_roughness_samples_follow_their_pdf() {
    const N: usize = 120_000;
    for (base, metallic, roughness, theta) in sampling_cases() {
        let wo = direction_at(theta);
        let at = |u: Vec4| Input { base, metallic, wo, roughness, wi: u.truncate(), pad: 0.0 };
        let corners = unit_corners();
        let inputs: Vec<Input> =
            corners.iter().copied().chain(unit_inputs(N, 32)).map(at).collect();
        let outputs = sample(&inputs);
        let is_cpu = gpu().device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        let m = inputs[0].material();
        let exact_wo = wo.as_dvec3();
        let what = format!("{m:?} at {theta}");
        for (input, [direction, weight]) in inputs.iter().zip(&outputs) {
            let (wi, pdf) = (direction.truncate(), f64::from(direction.w));
            let d = wi.as_dvec3();
            assert!(
                (d.length() - 1.0).abs() < 4e-7 && weight.is_finite(),
                "{what}: drawn are the direction and pdf {direction} and the weight {weight}, expected a direction of length 1 within 4e-7 and a finite weight"
            );
            if pdf == 0.0 {
                assert_eq!(*weight, Vec4::ZERO, "{what}, u {}: weight of a failed draw", input.wi);
                continue;
            }
            // GPUs divide to 2.5 ulp and normalise to 2, where CPUs do to ½: each step may be 8 times as wrong.
            let steps = if is_cpu { 2.0 } else { 16.0 };
            let tolerance = steps * lobe_tolerance(m.alpha, wo, wi);
            let exact_pdf = m.pdf(exact_wo, d);
            // Far out, at 10⁻¹¹ of the lobe's peak, sin² + cos² = 1 is needed to more digits than GPUs have (1e-6).
            let tail = if is_cpu { 0.0 } else { 1e-11 / (PI * m.alpha * m.alpha) };
            assert!(
                (pdf - exact_pdf).abs() < tolerance * exact_pdf + tail,
                "{what}, u {}: the pdf is {pdf}, expected {exact_pdf} within {tolerance:.1e} of it and {tail:.1e}",
                input.wi
            );
            let expected = m.evaluate(exact_wo, d).0 * (d.z / exact_pdf);
            for lane in 0..3 {
                let error = (f64::from(weight[lane]) - expected[lane]).abs();
                // Both share the lobe, whose error cancels, but for Fresnel's.
                assert!(
                    error < (tolerance + tail / exact_pdf) * expected[lane] + 4e-6,
                    "{what}, u {}: the weight is {weight}, expected {expected} within {:.1e} of it and 4e-6 in lane {lane}",
                    input.wi,
                    tolerance + tail / exact_pdf
                );
                assert!(
                    weight[lane] < 10.0,
                    "{what}, u {}: the weight is {weight}, expected below 10",
                    input.wi
                );
            }
        }
        let drawn = &outputs[corners.len()..];
        let chart = Chart::about(mirrored(wo), 4.0, [24, 24]);
        let ok = |o: &&[Vec4; 2]| o[0].w > 0.0;
        let directions = drawn.iter().filter(ok).map(|o| o[0].truncate().as_dvec3());
        let mut observed = chart.count(directions);
        let mut expected = chart.integrate(24, |d| m.pdf(exact_wo, d) * N as f64);
        observed.push(drawn.iter().filter(|o| !ok(o)).count() as u64);
        expected.push((N as f64 - expected.iter().sum::<f64>()).max(1e-9));
        assert_chi_square(&what, &observed, &expected);

        // The kernel's pdf over all directions, and what failed, are everything.
        let failed = observed.last().copied().unwrap_or(0) as f64 / N as f64;
        let nodes = Chart::about(mirrored(wo), 5.0, [1, 1]).nodes(128, 128);
        let inputs: Vec<Input> = nodes.iter().map(|(d, _)| at(d.as_vec3().extend(0.0))).collect();
        let sum: f64 =
            nodes.iter().zip(evaluate(&inputs)).map(|((_, w), [o, _])| w * f64::from(o.w)).sum();
        let chance = normal_limit(1) * (failed * (1.0 - failed) / N as f64).sqrt();
        assert!(
            (sum + failed - 1.0).abs() < chance + 3e-3,
            "{what}: the integral of the pdf is {sum} and {failed} of the draws fail, expected 1 in all within {:.1e}",
            chance + 3e-3
        );

        let albedo: f64 = chart.integrate(24, |d| m.evaluate(exact_wo, d).0.x * d.z).iter().sum();
        let mean = drawn.iter().map(|o| f64::from(o[1].x)).sum::<f64>() / N as f64;
        let square = drawn.iter().map(|o| f64::from(o[1].x).powi(2)).sum::<f64>() / N as f64;
        let error = ((square - mean * mean).max(0.0) / N as f64).sqrt();
        assert!(
            (mean - albedo).abs() < normal_limit(1) * error + 1e-3 * albedo,
            "{what}: mean weight of draws is {mean} ± {error}, expected the albedo {albedo} by its standard error and 1e-3 of it"
        );
    }
}

/// D·cos over the hemisphere and the density of mirrored visible normals over the sphere, on the GPU,
/// integrate to 1 (midpoint rule about the peak: 3e-3).
#[test]
fn ggx_densities_integrate_to_one() {
    let mut inputs: Vec<[Vec4; 2]> = Vec::new();
    let mut weights = Vec::new();
    let mut cases = Vec::new();
    for alpha in [1e-3f32, 0.01, 0.1, 0.5, 1.0] {
        for degrees in [0.0f64, 40.0, 80.0, 88.0] {
            let wo = direction_at(degrees.to_radians());
            if alpha * wo.z < 5e-4 {
                // The lobe, α wide and foreshortened to α·cos, slips between the nodes.
                continue;
            }
            cases.push((alpha, degrees));
            // About the normal for D, about the mirror direction for the reflection.
            let normals = Chart::about(DVec3::Z, 5.0, [1, 1]).nodes(128, 128);
            let mirrors = Chart::about(mirrored(wo), 5.0, [1, 1]).nodes(128, 128);
            for ((h, h_weight), (wi, wi_weight)) in normals.into_iter().zip(mirrors) {
                let half = (wo.as_dvec3() + wi).normalize().as_vec3();
                inputs.push([h.as_vec3().extend(wo.z), half.extend(alpha)]);
                weights.push([h_weight, wi_weight]);
            }
        }
    }
    let outputs: Vec<[f32; 2]> = map(
        "#import lucerna::bsdf::ggx::{ggx_distribution, pdf_ggx_reflection}
        struct Input { h: vec4<f32>, half: vec4<f32> }
        alias Output = vec2<f32>;
        fn map(input: Input) -> vec2<f32> {
            let alpha = input.half.w;
            return vec2<f32>(
                select(0.0, ggx_distribution(input.h.xyz, alpha) * input.h.z, input.h.z > 0.0),
                select(0.0, pdf_ggx_reflection(input.h.w, input.half.xyz, alpha), input.half.z > 0.0),
            );
        }",
        &inputs,
    );
    for (chunk, (alpha, degrees)) in cases.into_iter().enumerate() {
        let range = chunk * 128 * 128..(chunk + 1) * 128 * 128;
        for lane in 0..2 {
            let sum: f64 = outputs[range.clone()]
                .iter()
                .zip(&weights[range.clone()])
                .map(|(o, w)| f64::from(o[lane]) * w[lane])
                .sum();
            assert!(
                (sum - 1.0).abs() < 3e-3,
                "{}, α {alpha}, {degrees}°: the integral is {sum}, expected 1 within 3e-3",
                ["D · cos", "density of reflections"][lane]
            );
        }
    }
}

/// Schlick in f64: 6 roundings, cosines beyond [0, 1] clamped.
#[test]
fn schlick_matches_f64() {
    let mut random = Random(33);
    let mut inputs: Vec<Vec4> =
        [-0.1, 0.0, 0.5, 1.0, 1.000_001].map(|c| Vec4::new(0.0, 0.04, 1.0, c)).into();
    inputs.extend(unit_inputs(10_000, 34));
    inputs.extend((0..1000).map(|_| Vec4::new(0.5, 0.04, 0.0, 1.0 - random.unit() * 1e-3)));
    let outputs: Vec<Vec4> = map(
        "#import lucerna::bsdf::fresnel::schlick_fresnel
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: vec4<f32>) -> vec4<f32> { return vec4<f32>(schlick_fresnel(input.xyz, input.w), 0.0); }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let m = (1.0 - f64::from(input.w)).clamp(0.0, 1.0).powi(5);
        for lane in 0..3 {
            let f0 = f64::from(input[lane]);
            let expected = f0 + (1.0 - f0) * m;
            assert!(
                (f64::from(output[lane]) - expected).abs() < 6e-7,
                "f₀ {}, cosine {}: Fresnel's factor is {}, expected {expected} within 6e-7",
                input[lane],
                input.w,
                output[lane]
            );
        }
    }
}

/// ρ/π; draws by chi-square against cos/π; weight = f·cos/pdf = ρ.
#[test]
fn lambert_matches_its_closed_forms() {
    const N: usize = 100_000;
    let inputs: Vec<Vec4> = unit_corners().into_iter().chain(unit_inputs(N, 35)).collect();
    let outputs: Vec<[Vec4; 2]> = map(
        "#import lucerna::bsdf::lambert::{evaluate_lambert, sample_lambert, pdf_lambert}
        alias Input = vec4<f32>;
        struct Output { direction: vec4<f32>, rest: vec4<f32> }
        fn map(u: vec4<f32>) -> Output {
            let albedo = vec3<f32>(0.25, 0.5, u.w);
            let s = sample_lambert(albedo, u.xy);
            let f = evaluate_lambert(albedo);
            return Output(vec4<f32>(s.direction, s.pdf), vec4<f32>(f.z, s.weight.z, pdf_lambert(s.direction.z), pdf_lambert(-0.5)));
        }",
        &inputs,
    );
    for (u, [direction, rest]) in inputs.iter().zip(&outputs) {
        let albedo = f64::from(u.w);
        assert!(
            (f64::from(rest.x) - albedo * FRAC_1_PI).abs() < 1e-7,
            "albedo {albedo}: f is {}, expected {} within 1e-7",
            rest.x,
            albedo * FRAC_1_PI
        );
        assert_eq!(
            (rest.y, rest.z, rest.w),
            (u.w, direction.w, 0.0),
            "u {u}: weight of the draw, pdf of its direction, and pdf below"
        );
        let pdf = f64::from(direction.z) * FRAC_1_PI;
        assert!(
            (f64::from(direction.w) / pdf - 1.0).abs() < 2e-7,
            "u {u}: direction and pdf are {direction}, expected the pdf {pdf} within 2e-7 of it"
        );
        let weight = f64::from(rest.x) * f64::from(direction.z) / f64::from(direction.w);
        assert!(
            (weight - albedo).abs() < 4e-7,
            "u {u}: f · cos/pdf is {weight}, expected the albedo {albedo} within 4e-7"
        );
    }
    let chart = Chart::uniform([24, 32]);
    let expected = chart.integrate(16, |d| d.z.max(0.0) * FRAC_1_PI * N as f64);
    let directions = outputs[64..].iter().map(|o| o[0].truncate().as_dvec3());
    assert_chi_square("lambert", &chart.count(directions), &expected);
}

/// The fitted directional albedo against the model's own by quadrature. The module states 0.03 for
/// each of the fit's two terms; f₀ ≤ 1 weighs the first, so both together may be off by 0.05.
#[test]
fn directional_albedo_is_near_the_integral() {
    let wgsl = "#import lucerna::bsdf::metallic_roughness::metallic_roughness
        #import lucerna::bsdf::directional_albedo::directional_albedo
        struct Input { base: vec3<f32>, metallic: f32, roughness: f32, cosine: f32, pad: vec2<f32> }
        struct Output { albedo: vec4<f32> }
        fn map(in: Input) -> Output {
            let m = metallic_roughness(in.base, in.metallic, in.roughness);
            return Output(vec4<f32>(directional_albedo(m, in.cosine), 0.0));
        }";
    let base = Vec3::new(1.0, 0.6, 0.1);
    let mut inputs = Vec::new();
    for roughness in ROUGHNESSES.into_iter().filter(|&roughness| roughness >= 0.2) {
        for metallic in [0.0f32, 0.5, 1.0] {
            for degrees in (0..=85).step_by(5) {
                let cosine = f64::from(degrees).to_radians().cos() as f32;
                inputs.push([base.x, base.y, base.z, metallic, roughness, cosine, 0.0, 0.0]);
            }
        }
    }
    let mut worst = (0.0, [0.0; 8]);
    for (input, out) in inputs.iter().zip(map::<_, [f32; 4]>(wgsl, &inputs)) {
        let cosine = f64::from(input[5]);
        let wo = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        let expected = Material::new(base, input[3], input[4]).albedo(wo, 60);
        let error = (Vec3::from_slice(&out[..3]).as_dvec3() - expected).largest();
        if error > worst.0 {
            worst = (error, *input);
        }
        assert_each(
            &format!("colour, metallic, roughness, cosine {:?}: albedo", &input[..6]),
            &out[..3],
            "within 0 to 1",
            |&x| (0.0..=1.0).contains(&x),
        );
    }
    eprintln!("largest error {worst:?}");
    assert!(
        worst.0 <= 0.05,
        "colour, metallic, roughness, cosine {:?}: the fitted albedo is off by {}, expected at most 0.05",
        &worst.1[..6],
        worst.0
    );
}

/// What a material reflects of even light into the whole hemisphere: 2·∫ρ(μ)·μ dμ, in f64.
pub fn hemispherical_albedo(base: Vec3, metallic: f32, roughness: f32) -> DVec3 {
    const N: u32 = 24;
    let material = Material::new(base, metallic, roughness);
    (0..N)
        .map(|ix| {
            // Even steps of μ².
            let cosine = ((f64::from(ix) + 0.5) / f64::from(N)).sqrt();
            let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            material.albedo(wo, 60) / f64::from(N)
        })
        .sum()
}

/// Against quadrature in f64: as near as the directional albedo is, 0.05, of which the mean over viewers keeps less.
#[test]
fn hemispherical_albedo_is_near_the_integral() {
    let wgsl = "#import lucerna::bsdf::metallic_roughness::metallic_roughness
        #import lucerna::bsdf::directional_albedo::hemispherical_albedo
        struct Input { base: vec3<f32>, metallic: f32, roughness: f32, pad_a: f32, pad: vec2<f32> }
        struct Output { albedo: vec4<f32> }
        fn map(in: Input) -> Output {
            let m = metallic_roughness(in.base, in.metallic, in.roughness);
            return Output(vec4<f32>(hemispherical_albedo(m), 0.0));
        }";
    let base = Vec3::new(1.0, 0.6, 0.1);
    let mut inputs = Vec::new();
    for roughness in [0.2f32, 0.35, 0.5, 0.75, 1.0] {
        for metallic in [0.0f32, 0.5, 1.0] {
            inputs.push([base.x, base.y, base.z, metallic, roughness, 0.0, 0.0, 0.0]);
        }
    }
    let mut worst = 0.0f64;
    for (input, out) in inputs.iter().zip(map::<_, [f32; 4]>(wgsl, &inputs)) {
        let expected = hemispherical_albedo(base, input[3], input[4]);
        let error = (Vec3::from_slice(&out[..3]).as_dvec3() - expected).largest();
        worst = worst.max_nan(error);
        assert!(
            error <= 0.03,
            "colour, metallic, roughness {:?}: hemispherical albedo is {:?}, expected {expected} within 0.03",
            &input[..5],
            &out[..3]
        );
    }
    eprintln!("largest error {worst}");
}

/// The specular term's share of uniform light is in [0, 1] for every material, although the fits of its two parts are below
/// zero together for rough dielectrics (at roughness 1 by 0.0017).
#[test]
fn specular_albedo_is_never_negative() {
    let wgsl = "#import lucerna::bsdf::metallic_roughness::metallic_roughness
        #import lucerna::bsdf::directional_albedo::specular_albedo
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(in: Input) -> Output {
            let m = metallic_roughness(vec3<f32>(in.x, 0.0, 1.0), in.y, in.z);
            return vec4<f32>(specular_albedo(m, in.w), 0.0);
        }";
    let steps = |n: usize| (0..=n).map(move |k| k as f32 / n as f32);
    let mut inputs: Vec<[f32; 4]> = Vec::new();
    for (base, metallic) in [(0.0, 0.0), (1.0, 0.0), (0.5, 0.5), (0.0, 1.0), (1.0, 1.0)] {
        for roughness in steps(40) {
            inputs.extend(steps(40).map(|cosine| [base, metallic, roughness, cosine]));
        }
    }
    let found: Vec<_> = inputs.iter().zip(map::<_, [f32; 4]>(wgsl, &inputs)).collect();
    assert_each(
        "colour, metallic, roughness, cosine, and specular albedo",
        &found,
        "each component in [0, 1]",
        |(_, albedo)| albedo[..3].iter().all(|share| (0.0..=1.0).contains(share)),
    );
}

/// The specular lobe alone: its density and f·cos/pdf = F·G₂/G₁ in f64, about the half vector of what was drawn; the weight never above 1. And its
/// mean weight is the specular term's albedo, to the 0.03 that the fit states for each of its two terms.
#[test]
fn specular_lobe_matches_f64_and_its_albedo() {
    const SIDE: usize = 24;
    let wgsl = "#import lucerna::bsdf::metallic_roughness::{metallic_roughness, sample_specular_lobe}
        #import lucerna::bsdf::directional_albedo::specular_albedo
        struct Input { base: vec3<f32>, metallic: f32, wo: vec3<f32>, roughness: f32, u: vec4<f32> }
        struct Output { wi: vec3<f32>, pdf: f32, weight: vec3<f32>, pad: f32, albedo: vec4<f32> }
        fn map(in: Input) -> Output {
            let m = metallic_roughness(in.base, in.metallic, in.roughness);
            let drawn = sample_specular_lobe(m, in.wo, in.u.xy);
            return Output(drawn.direction, drawn.pdf, drawn.weight, 0.0, vec4<f32>(specular_albedo(m, in.wo.z), 0.0));
        }";
    let base = Vec3::new(1.0, 0.6, 0.1);
    let mut inputs: Vec<[f32; 12]> = Vec::new();
    for roughness in [0.2f32, 0.5, 1.0] {
        for metallic in [0.0f32, 1.0] {
            for degrees in [0.0f64, 40.0, 75.0] {
                let (y, z) = degrees.to_radians().sin_cos();
                for ix in 0..SIDE * SIDE {
                    let u = [ix % SIDE, ix / SIDE].map(|k| (k as f32 + 0.5) / SIDE as f32);
                    inputs.push([
                        base.x, base.y, base.z, metallic, 0.0, y as f32, z as f32, roughness, u[0],
                        u[1], 0.0, 0.0,
                    ]);
                }
            }
        }
    }
    let found = map::<_, [f32; 12]>(wgsl, &inputs);
    for (inputs, found) in inputs.chunks(SIDE * SIDE).zip(found.chunks(SIDE * SIDE)) {
        let mut mean = DVec3::ZERO;
        for (input, found) in inputs.iter().zip(found) {
            let m = Material::new(base, input[3], input[7]);
            let (wo, wi) = (Vec3::from_slice(&input[4..7]), Vec3::from_slice(&found[..3]));
            let weight = Vec3::from_slice(&found[4..7]).as_dvec3();
            let what = format!(
                "metallic {}, roughness {}, wo {wo}, u {:?}",
                input[3],
                input[7],
                &input[8..10]
            );
            if wi.z <= 0.0 {
                assert_eq!(found[3], 0.0, "{what}: pdf of a draw below the surface");
                continue;
            }
            mean += weight / (SIDE * SIDE) as f64;
            let (wo_exact, wi_exact) = (wo.as_dvec3(), wi.as_dvec3());
            let pdf = m.visible(wo_exact, wi_exact);
            let tolerance = 4.0 * lobe_tolerance(m.alpha, wo, wi);
            assert!(
                (f64::from(found[3]) - pdf).abs() <= tolerance * pdf,
                "{what}: the lobe's pdf is {}, expected {pdf} within {tolerance:.1e} of it",
                found[3]
            );
            let h = (wo_exact + wi_exact).normalize();
            let root = |z: f64| (m.alpha * m.alpha + (1.0 - m.alpha * m.alpha) * z * z).sqrt();
            let masked = 2.0 * wo_exact.z / (wo_exact.z + root(wo_exact.z));
            let both = 4.0 * wo_exact.z * wi_exact.z * m.v(wo_exact, wi_exact);
            let expected = m.fresnel(wo_exact.dot(h)) * both / masked;
            assert!(
                (weight - expected).largest() < 1e-5,
                "{what}: the lobe's weight is {weight}, expected {expected} within 1e-5"
            );
            assert!(
                weight.max_element() <= 1.0 + 1e-5,
                "{what}: the lobe's weight is {weight}, expected at most 1 + 1e-5"
            );
        }
        let albedo = Vec3::from_slice(&found[0][8..11]).as_dvec3();
        assert!(
            (albedo - mean).largest() < 0.05,
            "colour, metallic, wo, roughness {:?}: specular albedo is {albedo}, expected the mean weight {mean} within 0.05",
            [&inputs[0][..4], &inputs[0][4..8]]
        );
    }
}

/// A viewer below the surface gets nothing of the lobe.
#[test]
fn specular_lobe_is_empty_from_below() {
    let wgsl = "#import lucerna::bsdf::metallic_roughness::{metallic_roughness, sample_specular_lobe}
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(in: Input) -> Output {
            let drawn = sample_specular_lobe(metallic_roughness(vec3<f32>(1.0), 1.0, 0.5), in.xyz, vec2<f32>(in.w, 0.3));
            return vec4<f32>(drawn.weight, drawn.pdf);
        }";
    let mut random = Random(61);
    let inputs: Vec<Vec4> = (0..1000)
        .map(|_| {
            let d = random.direction();
            Vec3::new(d.x, d.y, -d.z.abs()).extend(random.unit())
        })
        .collect();
    for (input, found) in inputs.iter().zip(map::<_, Vec4>(wgsl, &inputs)) {
        assert_eq!(found, Vec4::ZERO, "wo and u {input}: weight and pdf of the lobe from below");
    }
}

/// Where a GGX lobe's light comes from, and how wide it is, against integrals of D·V·cos over the hemisphere in f64: the direction of the mean within 0.08 rad,
/// and its length (the mean cosine) within 0.05 of that of the lobe exp(κ(ω·d − 1)) above the surface, as documented.
#[test]
fn ggx_lobes_have_a_mean() {
    let mut inputs: Vec<Vec4> = Vec::new();
    for alpha in [1.0f32, 0.81, 0.56, 0.36, 0.25, 0.16, 0.09, 0.05] {
        for cosine in [1.0f32, 0.9, 0.7, 0.5, 0.3, 0.2] {
            inputs.push(Vec4::new(alpha, cosine, 0.0, 0.0));
        }
    }
    let found: Vec<Vec4> = map(
        "#import lucerna::bsdf::ggx::{mean_of_ggx, sharpness_of_ggx}
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             let to_viewer = vec3<f32>(-sqrt(max(1.0 - x.y * x.y, 0.0)), 0.0, x.y);
             return vec4<f32>(mean_of_ggx(vec3<f32>(0.0, 0.0, 1.0), to_viewer, x.x), sharpness_of_ggx(x.x));
         }",
        &inputs,
    );
    for (input, found) in inputs.iter().zip(&found) {
        let (alpha, cosine) = (f64::from(input.x), f64::from(input.y));
        let wo = DVec3::new(-(1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        let lobe = found.truncate().as_dvec3();
        assert!((lobe.length() - 1.0).abs() < 1e-5, "{input}: length {}", lobe.length());
        let sharpness = f64::from(found.w);
        let (mut ggx, mut fit) = ([DVec3::ZERO; 2], [DVec3::ZERO; 2]);
        const N: usize = 400;
        for k in 0..N * N {
            let z = ((k % N) as f64 + 0.5) / N as f64;
            let angle = std::f64::consts::TAU * ((k / N) as f64 + 0.5) / N as f64;
            let r = (1.0 - z * z).sqrt();
            let wi = DVec3::new(r * angle.cos(), r * angle.sin(), z);
            let h = (wi + wo).normalize();
            let a2 = alpha * alpha;
            let d = a2 / (h.z * h.z * (a2 - 1.0) + 1.0).powi(2);
            let lambda = |c: f64| (a2 + (1.0 - a2) * c * c).sqrt();
            let weight = d * z / (z * lambda(cosine) + cosine * lambda(z));
            ggx[0] += weight * wi;
            ggx[1] += DVec3::splat(weight);
            let weight = (sharpness * (wi.dot(lobe) - 1.0)).exp();
            fit[0] += weight * wi;
            fit[1] += DVec3::splat(weight);
        }
        let [mean, of_fit] = [ggx, fit].map(|[sum, weight]| sum / weight);
        let angle = mean.normalize().dot(lobe.normalize()).clamp(-1.0, 1.0).acos();
        let apart = (mean.length() - of_fit.length()).abs();
        assert!(
            angle < 0.08 && apart < 0.05,
            "alpha {alpha}, cosine {cosine}: direction off by {angle}, mean cosine {} instead of {}",
            of_fit.length(),
            mean.length()
        );
    }
}
