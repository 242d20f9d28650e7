// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/color`.

use crate::harness::{KeepNan, Largest, Random, Tolerance, assert_near, map};
use glam::{DMat3, DVec3, Vec4};

/// Colours in [0, 1]³: corners, greys, and random ones of all magnitudes.
fn colours(n: usize, seed: u64) -> Vec<Vec4> {
    let mut random = Random(seed);
    let mut out = Vec::new();
    for corner in 0..8 {
        out.push(Vec4::from_array(
            [0, 1, 2, 3].map(|axis| f32::from(u8::from(corner >> axis & 1 == 1))),
        ));
    }
    out.extend((0..=1024).map(|i| Vec4::splat(i as f32 / 1024.0)));
    for _ in 0..n {
        let scale = 10f32.powf(random.range(-6.0, 0.0));
        out.push(Vec4::from_array([(); 4].map(|()| random.unit())));
        out.push(Vec4::from_array([(); 4].map(|()| random.unit() * scale)));
    }
    out
}

/// Runs a function of vec3 to vec3.
fn map_colours(path: &str, inputs: &[Vec4]) -> Vec<Vec4> {
    let name = path.rsplit("::").next().expect("a path has a name");
    map(
        &format!(
            "#import lucerna::color::{path}
            alias Input = vec4<f32>;
            alias Output = vec4<f32>;
            fn map(input: Input) -> Output {{ return vec4<f32>({name}(input.xyz), 0.0); }}"
        ),
        inputs,
    )
}

fn encode(linear: f64) -> f64 {
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

fn decode(srgb: f64) -> f64 {
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

/// Inputs of the transfer function: both sides of the thresholds, all bytes, [0, 1], beyond.
fn transfer_inputs() -> Vec<Vec4> {
    let mut inputs = colours(10_000, 1);
    for threshold in [0.0031308f32, 0.04045] {
        for step in -40..=40 {
            let near = f32::from_bits(threshold.to_bits().wrapping_add_signed(step));
            inputs.push(Vec4::new(near, near + step as f32 * 1e-5, threshold * 1.05, 0.0));
        }
    }
    inputs.extend((0..256).map(|i| Vec4::splat(i as f32 / 255.0)));
    inputs.extend([Vec4::splat(-0.5), Vec4::splat(-0.0), Vec4::new(1.5, 4.0, 100.0, 0.0)]);
    inputs
}

/// Relative to the result. WGSL allows log2 an error of 3 ulp (2⁻²¹ absolute close to 1), and exp2
/// one of 3 + 2|x| ulp. Encoding: exponents reach −3.5, and the subtraction of 0.055
/// magnifies 2.2e-6 by at most 2.4; decoding: exponents reach −8.3, 4.8e-6. Beyond 1: the same
/// scale. 6e-6 covers both.
#[test]
fn srgb_follows_the_standard() {
    let tolerance = Tolerance { relative: 6e-6, absolute: 1e-37, ..Tolerance::EXACT };
    let inputs = transfer_inputs();
    type Oracle = fn(f64) -> f64;
    for (path, oracle) in
        [("srgb::srgb_from_linear", encode as Oracle), ("srgb::linear_from_srgb", decode)]
    {
        let outputs = map_colours(path, &inputs);
        // At its two thresholds the standard's curve itself leaps by up to 3e-8; an input
        // within an f32 of the threshold may take either piece.
        let worst = assert_near(path, &inputs, &outputs, tolerance, |input| {
            input.truncate().as_dvec3().to_array().map(oracle)
        });
        eprintln!("{path}: worst error {worst:.3} tolerances");
    }
}

/// The pieces are told apart at the standard's thresholds: a curve taken too early or late is off by
/// far more than rounding.
#[test]
fn srgb_bytes_survive() {
    let bytes: Vec<Vec4> = (0..256).map(|i| Vec4::splat(i as f32 / 255.0)).collect();
    let linear = map_colours("srgb::linear_from_srgb", &bytes);
    let back = map_colours("srgb::srgb_from_linear", &linear);
    for (i, value) in back.iter().enumerate() {
        let byte = value.x * 255.0;
        assert!(
            (byte - i as f32).abs() < 1e-2,
            "sRGB byte {i} comes back as {byte}, expected within 1e-2"
        );
    }
    assert!(
        (linear[255].x - 1.0).abs() < 1e-6,
        "byte 255 is decoded to {}, expected 1 within 1e-6",
        linear[255].x
    );
    assert_eq!(linear[0].x, 0.0, "byte 0, decoded");
}

/// Three products and two sums: 4 u of the sum of magnitudes, 2.4e-7; weights rounded to f32, 1 u.
#[test]
fn luminance_is_the_weighted_sum() {
    let mut inputs = colours(10_000, 2);
    let mut random = Random(3);
    inputs.extend((0..10_000).map(|_| Vec4::from_array([(); 4].map(|()| random.range(-1e4, 1e4)))));
    let outputs: Vec<f32> = map(
        "#import lucerna::color::luminance::luminance
        alias Input = vec4<f32>;
        alias Output = f32;
        fn map(input: Input) -> Output { return luminance(input.xyz); }",
        &inputs,
    );
    let weights = DVec3::new(0.2126, 0.7152, 0.0722);
    for (input, output) in inputs.iter().zip(&outputs) {
        let rgb = input.truncate().as_dvec3();
        let error = (f64::from(*output) - rgb.dot(weights)).abs();
        let bound = 3.0e-7 * rgb.abs().dot(weights);
        assert!(
            error <= bound,
            "luminance of {input} is {output}, expected {}: off by {error:e}, expected at most {bound:e}",
            rgb.dot(weights)
        );
    }
}

/// IEC 61966-2-1's matrix, by columns.
fn xyz_matrix() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(0.4124, 0.2126, 0.0193),
        DVec3::new(0.3576, 0.7152, 0.1192),
        DVec3::new(0.1805, 0.0722, 0.9505),
    )
}

/// 5 u of the sum of magnitudes; the inverse's entries are printed to 9 decimals and rounded to f32.
#[test]
fn xyz_is_the_standard_matrix_and_its_inverse() {
    let matrix = xyz_matrix();
    let mut random = Random(4);
    let mut inputs = colours(10_000, 5);
    inputs.extend((0..10_000).map(|_| Vec4::from_array([(); 4].map(|()| random.range(-2.0, 2.0)))));
    for (path, matrix) in
        [("xyz::xyz_from_linear", matrix), ("xyz::linear_from_xyz", matrix.inverse())]
    {
        let outputs = map_colours(path, &inputs);
        for (input, output) in inputs.iter().zip(&outputs) {
            let v = input.truncate().as_dvec3();
            let expected = matrix * v;
            let scale = DMat3::from_cols_array(&matrix.to_cols_array().map(f64::abs)) * v.abs();
            for axis in 0..3 {
                let error = (f64::from(output[axis]) - expected[axis]).abs();
                assert!(
                    error <= 3e-7 * scale[axis] + 1e-9 * v.length(),
                    "{path}({input}) is {output}, expected {expected}: off by {error:e} in axis {axis}, expected at most {:e}",
                    3e-7 * scale[axis] + 1e-9 * v.length()
                );
            }
        }
    }
}

fn lab(rgb: DVec3) -> DVec3 {
    let white = xyz_matrix() * DVec3::ONE;
    // CIE's own constants: ε = 216/24389, κ = 24389/27.
    let f = (xyz_matrix() * rgb / white)
        .to_array()
        .map(|t| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 });
    DVec3::new(116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2]))
}

/// Cube roots by log2 and exp2 in WGSL's bounds are right to 1.4e-6 of f ≤ 1: 116, 2·500 and 2·200
/// times that are the errors of L*, a* and b*.
#[test]
fn lab_follows_the_standard() {
    let inputs = colours(20_000, 6);
    let outputs = map_colours("lab::lab_from_linear", &inputs);
    let lightness: Vec<f32> = map(
        "#import lucerna::color::lab::lightness
        alias Input = vec4<f32>;
        alias Output = f32;
        fn map(input: Input) -> Output { return lightness(input.xyz); }",
        &inputs,
    );
    let mut worst = DVec3::ZERO;
    for ((input, output), lightness) in inputs.iter().zip(&outputs).zip(&lightness) {
        let expected = lab(input.truncate().as_dvec3());
        let error = (output.truncate().as_dvec3() - expected).abs();
        assert!(
            error.cmple(DVec3::new(2e-4, 1.5e-3, 6e-4)).all(),
            "L*a*b* of {input} is {output}, expected {expected} within 2e-4, 1.5e-3 and 6e-4"
        );
        assert!(
            (f64::from(*lightness) - expected.x).abs() < 2e-4,
            "lightness of {input} is {lightness}, expected {} within 2e-4",
            expected.x
        );
        worst = worst.max(error);
    }
    eprintln!("lab: worst errors {worst}");
    // Published: red, green and blue of sRGB (to the digits in which the printed matrices agree).
    for (rgb, published) in [
        (DVec3::X, DVec3::new(53.24, 80.09, 67.20)),
        (DVec3::Y, DVec3::new(87.73, -86.18, 83.18)),
        (DVec3::Z, DVec3::new(32.30, 79.19, -107.86)),
        (DVec3::ONE, DVec3::new(100.0, 0.0, 0.0)),
    ] {
        assert!(
            (lab(rgb) - published).length() < 0.03,
            "L*a*b* in f64 of {rgb} is {}, expected the published {published} within 0.03",
            lab(rgb)
        );
    }
}

/// f is right to 4.5e-7 (its two terms' divisions and sum), f³ to 1.5e-6, and the matrix's rows weigh up
/// to 5.3: 8e-6, rounded up.
#[test]
fn lab_comes_back() {
    let colours = colours(20_000, 7);
    let inputs: Vec<Vec4> =
        colours.iter().map(|c| lab(c.truncate().as_dvec3()).as_vec3().extend(0.0)).collect();
    let outputs = map_colours("lab::linear_from_lab", &inputs);
    let mut worst = 0.0f64;
    for (colour, output) in colours.iter().zip(&outputs) {
        let error = (*output - *colour).truncate().as_dvec3().largest();
        assert!(
            error < 1e-5,
            "{colour} comes back from L*a*b* as {output}, expected within 1e-5: off by {error:e}"
        );
        worst = worst.max_nan(error);
    }
    eprintln!("linear_from_lab: worst error {worst:e}");
}

/// exp2 and log2 in WGSL's bounds: (3 + 2|x|) ulp relative, and 3 ulp or 2⁻²¹ absolute.
#[test]
fn exposures_are_powers_of_two() {
    let mut inputs: Vec<f32> = (-20..=20).map(|ev| ev as f32).collect();
    let mut random = Random(8);
    inputs.extend((0..10_000).map(|_| random.range(-30.0, 30.0)));
    let outputs: Vec<[f32; 3]> = map(
        "#import lucerna::color::exposure::{exposure_scale, ev_from_luminance, saturation_exposure}
        alias Input = f32;
        struct Output { scale: f32, ev: f32, saturation: f32 }
        fn map(input: Input) -> Output {
            return Output(exposure_scale(input), ev_from_luminance(abs(input) + 1e-3), saturation_exposure(input));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let x = f64::from(*input);
        let bound = (6.0 + 2.0 * x.abs()) * f64::from(f32::EPSILON);
        let scale = f64::from(output[0]) / x.exp2() - 1.0;
        assert!(
            scale.abs() < bound,
            "exposure scale of {input} is {}, expected 2^{input}: off by {scale:e} of it, expected below {bound:e}",
            output[0]
        );
        let saturation = f64::from(output[2]) * 1.2 * x.exp2() - 1.0;
        assert!(
            saturation.abs() < bound,
            "saturation exposure of {input} is {}, expected {}: off by {saturation:e} of it, expected below {bound:e}",
            output[2],
            (-x).exp2() / 1.2
        );
        let luminance = f64::from(input.abs() + 1e-3);
        let ev = (luminance * 100.0 / 12.5).log2();
        assert!(
            (f64::from(output[1]) - ev).abs() < 2e-6,
            "EV of {luminance} is {}, expected {ev} within 2e-6",
            output[1]
        );
    }
}

/// Khronos PBR Neutral by the specification's formulas, in f64.
fn neutral(rgb: DVec3) -> DVec3 {
    const F: f64 = 0.04;
    const START: f64 = 0.8 - F;
    let x = rgb.min_element();
    let f = if x <= 2.0 * F { x - x * x / (4.0 * F) } else { F };
    let base = rgb - f;
    let p = base.max_element();
    if p <= START {
        return base;
    }
    let pn = 1.0 - (1.0 - START).powi(2) / (p + 1.0 - 2.0 * START);
    let g = 1.0 / (0.15 * (p - pn) + 1.0);
    base * (pn / p) * g + DVec3::splat(pn) * (1.0 - g)
}

/// All operations are exact to 1 ulp of numbers ≤ 1 (divisions 2.5): 16 u, 1e-6; 1 − 1/(…) ≤ 1 too.
#[test]
fn neutral_tone_map_follows_the_specification() {
    let mut inputs = colours(10_000, 9);
    let mut random = Random(10);
    for _ in 0..20_000 {
        let scale = 10f32.powf(random.range(-3.0, 6.0));
        inputs.push(Vec4::from_array([(); 4].map(|()| random.unit() * scale)));
    }
    for near in [0.08f32, 0.76, 0.8] {
        inputs.extend(
            [-1, 0, 1].map(|i| Vec4::splat(f32::from_bits(near.to_bits().wrapping_add_signed(i)))),
        );
    }
    inputs.extend([Vec4::splat(1e37), Vec4::new(1e37, 0.0, 0.0, 0.0)]);
    let outputs = map_colours("tonemap::tonemap_neutral", &inputs);
    let mut worst = 0.0f64;
    for (input, output) in inputs.iter().zip(&outputs) {
        let expected = neutral(input.truncate().as_dvec3());
        let error = (output.truncate().as_dvec3() - expected).largest();
        assert!(error < 1e-6, "tone-mapped {input} is {output}, expected {expected} within 1e-6");
        assert!(
            output.truncate().max_element() <= 1.0,
            "tone-mapped {input} is {output}, expected at most 1"
        );
        worst = worst.max_nan(error);
    }
    eprintln!("tonemap_neutral: worst error {worst:e}");
    // Its point: base colour b plus 4 % of specular comes out as b, up to 0.76.
    let base = [0.1f32, 0.5, 0.76].map(|b| Vec4::splat(b + 0.04));
    let outputs = map_colours("tonemap::tonemap_neutral", &base);
    for (input, output) in base.iter().zip(&outputs) {
        assert!(
            (output.x - (input.x - 0.04)).abs() < 1e-6,
            "tone-mapped {input} is {output}, expected {} within 1e-6",
            input.x - 0.04
        );
    }
}
