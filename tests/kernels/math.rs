// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/math`.

use crate::harness::{KeepNan, Random, assert_each, map};
use glam::{DVec3, Vec3, Vec4};
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

/// Bit patterns of f32 of every kind (signs, zeros, subnormals, powers of two, infinities, NaN with
/// quiet and signalling payloads), then `n` random words.
fn words(n: usize, seed: u64) -> Vec<u32> {
    let mut out = Vec::new();
    for magnitude in [
        0,
        1,
        2,
        0x3f_ffff,
        0x40_0000,
        0x7f_fffe,
        0x7f_ffff,
        0x80_0000,
        0x80_0001,
        0x3eff_ffff,
        0x3f00_0000,
        0x3f7f_ffff,
        0x3f80_0000,
        0x3f80_0001,
        0x477f_e000,
        0x477f_f000,
        0x4780_0000,
        0x7f7f_fffe,
        0x7f7f_ffff,
        0x7f80_0000,
        0x7f80_0001,
        0x7fa0_0000,
        0x7fbf_ffff,
        0x7fc0_0000,
        0x7fc0_1234,
        0x7fff_ffff,
    ] {
        out.extend([magnitude, magnitude | 0x8000_0000]);
    }
    for exponent in 0..256 {
        out.extend([exponent << 23, (exponent << 23) | 0x8000_0000]);
    }
    let mut random = Random(seed);
    out.extend(std::iter::repeat_with(|| random.bits() as u32).take(n));
    out
}

/// Numbers ≥ 0 that a small float can tell apart: uniform exponents over 2⁻³⁰ … 2²⁰, and the edges.
fn positive_words(n: usize, seed: u64) -> Vec<u32> {
    let mut random = Random(seed);
    let mut spread =
        || ((97 + random.bits() % 50) as u32) << 23 | (random.bits() as u32 & 0x7f_ffff);
    let mut out: Vec<u32> = std::iter::repeat_with(&mut spread).take(n).collect();
    // Ties and their neighbours: few bits set below the last bit kept.
    for _ in 0..n {
        let coarse = spread() & !0xffff;
        out.extend([coarse, coarse.wrapping_sub(1), coarse + 1]);
    }
    out
}

/// Triples of inputs in vec4 slots.
fn triples(words: &[u32]) -> Vec<[u32; 4]> {
    words.chunks_exact(3).map(|c| [c[0], c[1], c[2], 0]).collect()
}

/// Directions along and near the axes, diagonals, and random ones.
pub fn directions(n: usize, seed: u64) -> Vec<Vec3> {
    let mut out = Vec::new();
    for x in [-1.0, -1e-4, -0.0, 0.0, 1e-4, 1.0] {
        for y in [-1.0, -1e-7, 0.0, 1e-7, 1.0] {
            for z in [-1.0, -1e-7, -0.0, 0.0, 1e-7, 1.0] {
                let v = DVec3::new(x, y, z);
                if v.length() > 0.5 {
                    out.push(v.normalize().as_vec3());
                }
            }
        }
    }
    let mut random = Random(seed);
    out.extend(std::iter::repeat_with(|| random.direction()).take(n));
    out
}

/// Columns are orthonormal and right-handed. Tolerance: the paper states 3.5e-7 worst error of an
/// entry in f32 for any normal; a unit normal rounded to f32 adds 2 roundings (1.2e-7).
#[test]
fn frame_is_orthonormal_everywhere() {
    let inputs: Vec<Vec4> = directions(20_000, 1).iter().map(|n| n.extend(0.0)).collect();
    let outputs: Vec<[Vec4; 3]> = map(
        "#import lucerna::math::frame::frame_from_normal
        struct Output { x: vec4<f32>, y: vec4<f32>, z: vec4<f32> }
        alias Input = vec4<f32>;
        fn map(input: Input) -> Output {
            let m = frame_from_normal(input.xyz);
            return Output(vec4<f32>(m[0], 0.0), vec4<f32>(m[1], 0.0), vec4<f32>(m[2], 0.0));
        }",
        &inputs,
    );
    for (input, columns) in inputs.iter().zip(&outputs) {
        let [x, y, z] = columns.map(|c| c.truncate().as_dvec3());
        assert_eq!(
            z.as_vec3(),
            input.truncate(),
            "third column of the frame of the normal {input}"
        );
        let errors = [
            x.dot(y).abs(),
            x.dot(z).abs(),
            y.dot(z).abs(),
            (x.length() - 1.0).abs(),
            (y.length() - 1.0).abs(),
            (x.cross(y) - z).length(),
        ];
        let worst = errors.into_iter().fold(0.0, f64::max_nan);
        assert!(
            worst < 5e-7,
            "normal {input}: the frame {columns:?} is off an orthonormal one by {worst:e}, expected below 5e-7"
        );
    }
}

/// Each constant is the f32 nearest to the real number; FLOAT_MAX is the 7-digit decimal below the
/// largest f32.
#[test]
fn constants_are_the_nearest_f32() {
    let outputs: Vec<[f32; 8]> = map(
        "#import lucerna::math::constants::{PI, TWO_PI, HALF_PI, INV_PI, INV_TWO_PI, INV_FOUR_PI, UNIT_ROUNDOFF, FLOAT_MAX}
        alias Input = u32;
        alias Output = array<f32, 8>;
        fn map(input: Input) -> Output {
            return array<f32, 8>(PI, TWO_PI, HALF_PI, INV_PI, INV_TWO_PI, INV_FOUR_PI, UNIT_ROUNDOFF, FLOAT_MAX);
        }",
        &[0u32],
    );
    let unit_roundoff = f64::from(f32::EPSILON) / 2.0;
    let expected = [
        PI,
        TAU,
        FRAC_PI_2,
        FRAC_1_PI,
        FRAC_1_PI / 2.0,
        FRAC_1_PI / 4.0,
        unit_roundoff,
        3.402823e38,
    ];
    assert_eq!(
        outputs[0],
        expected.map(|value| value as f32),
        "constants, in the order of the import"
    );
}

/// Exact, for every kind of bits.
#[test]
fn float_questions_are_answered_for_all_bits() {
    let inputs = words(30_000, 2);
    let outputs: Vec<u32> = map(
        "#import lucerna::math::float::{is_nan, is_infinite, is_finite, all_finite}
        alias Input = u32;
        alias Output = u32;
        fn map(input: Input) -> Output {
            let x = bitcast<f32>(input);
            var flags = u32(is_nan(x)) | u32(is_infinite(x)) << 1u | u32(is_finite(x)) << 2u;
            for (var i = 0u; i < 3u; i++) {
                var v = vec3<f32>(0.0, 1.0, -3e38);
                v[i] = x;
                flags |= u32(all_finite(v)) << (3u + i);
            }
            return flags;
        }",
        &inputs,
    );
    for (&bits, &flags) in inputs.iter().zip(&outputs) {
        let x = f32::from_bits(bits);
        let finite = u32::from(x.is_finite());
        let expected =
            u32::from(x.is_nan()) | (u32::from(x.is_infinite()) << 1) | (finite * 0b11_1100);
        assert_eq!(
            flags, expected,
            "flags of {x:?} ({bits:#010x}) are {flags:#b}, expected {expected:#b}: NaN, infinite, finite, and all finite three times"
        );
    }
}

/// Tolerance, in units of u = 2⁻²⁴, relative to each component: the sum of three squares of one
/// sign 3 u, half of it in the root; inverseSqrt 2 ulp = 4 u; the product 1 u: 6.5 u = 3.9e-7.
#[test]
fn safe_normalize_gives_unit_vectors_or_the_fallback() {
    let mut random = Random(3);
    let mut inputs = vec![Vec4::ZERO, Vec4::new(-0.0, 0.0, -0.0, 0.0)];
    for _ in 0..20_000 {
        let length = 10f64.powf(f64::from(random.range(-20.0, 20.0)));
        let v = random.direction().as_dvec3() * length;
        inputs.push(v.as_vec3().extend(0.0));
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, 1e19] {
        for axis in 0..3 {
            let mut v = Vec4::new(1.0, -2.0, 0.5, 0.0);
            v[axis] = bad;
            inputs.push(v);
        }
    }
    // Squares of y and z lie below the least normal f32.
    inputs.push(Vec4::new(1.01e-15, 1e-19, -1e-19, 0.0));
    let outputs: Vec<Vec4> = map(
        "#import lucerna::math::vector::safe_normalize
        alias Input = vec4<f32>;
        alias Output = vec4<f32>;
        fn map(input: Input) -> Output {
            return vec4<f32>(safe_normalize(input.xyz, vec3<f32>(7.0, 8.0, 9.0)), 0.0);
        }",
        &inputs,
    );
    let mut worst = 0.0f64;
    for (input, output) in inputs.iter().zip(&outputs) {
        let v = input.truncate().as_dvec3();
        let square = v.length_squared();
        if [1e-30, 1e37].iter().any(|bound| (square / bound - 1.0).abs() < 1e-6) {
            continue;
        }
        if (1e-30..=1e37).contains(&square) {
            let expected = v.normalize();
            for axis in 0..3 {
                let error = (f64::from(output[axis]) - expected[axis]).abs();
                let relative = if error == 0.0 { 0.0 } else { error / expected[axis].abs() };
                // Components below 1e-37 may be flushed.
                if expected[axis].abs() > 1e-30 {
                    worst = worst.max_nan(relative);
                }
            }
            assert!(
                worst < 4e-7,
                "{input} is normalised to {output}, expected {expected} within 4e-7 of each component"
            );
        } else {
            assert_eq!(
                output.truncate(),
                Vec3::new(7.0, 8.0, 9.0),
                "{input} is normalised, expected the fallback"
            );
        }
    }
    eprintln!("safe_normalize: worst relative error {worst:e}");
}

/// Exact, wherever the greatest and the least stand.
#[test]
fn component_extremes_are_exact() {
    let mut random = Random(4);
    let mut inputs: Vec<Vec4> =
        vec![Vec4::ZERO, Vec4::splat(-1.0), Vec4::new(f32::MAX, f32::MIN, 0.0, 0.0)];
    for _ in 0..10_000 {
        inputs.push(Vec4::from_array([(); 4].map(|()| random.range(-1e3, 1e3))));
    }
    let outputs: Vec<[f32; 2]> = map(
        "#import lucerna::math::vector::{max_component, min_component}
        alias Input = vec4<f32>;
        alias Output = vec2<f32>;
        fn map(input: Input) -> Output {
            return vec2<f32>(max_component(input.xyz), min_component(input.xyz));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        let v = input.truncate();
        assert_eq!(
            *output,
            [v.max_element(), v.min_element()],
            "greatest and least component of {v}"
        );
    }
}

/// The angle between two vectors of any length, right for small ones too.
fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

const OCTAHEDRAL: &str = "#import lucerna::math::octahedral::{pack_direction, unpack_direction, octahedral_from_direction, direction_from_octahedral}
    alias Input = vec4<f32>;
    struct Output { unpacked: vec4<f32>, mapped: vec4<f32>, point: vec2<f32>, packed: u32, again: u32 }
    fn map(input: Input) -> Output {
        let packed = pack_direction(input.xyz);
        let unpacked = unpack_direction(packed);
        let point = octahedral_from_direction(input.xyz);
        return Output(
            vec4<f32>(unpacked, 0.0), vec4<f32>(direction_from_octahedral(point), 0.0),
            point, packed, pack_direction(unpacked),
        );
    }";

#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Octahedral {
    unpacked: Vec4,
    mapped: Vec4,
    point: [f32; 2],
    packed: u32,
    again: u32,
}

/// Rounding moves a point of the square by h = 1/65534 along each axis at most, and so the point of
/// the octahedron by (h, h, −2h), √6 h; the octahedron is nowhere nearer than 1/√3 to the centre:
/// the angle is at most √18 h = 6.474e-5. Rounding in f32 before, 2⁻²³ of the coordinate, adds 1 %
/// at most.
#[test]
fn octahedral_directions_survive_packing() {
    let mut random = Random(6);
    let mut inputs: Vec<Vec4> = directions(400_000, 5).iter().map(|d| d.extend(0.0)).collect();
    // Lengths do not matter.
    for _ in 0..20_000 {
        let d = random.direction() * 10f32.powf(random.range(-30.0, 30.0));
        inputs.push(d.extend(0.0));
    }
    let outputs: Vec<Octahedral> = map(OCTAHEDRAL, &inputs);
    let (mut worst, mut worst_map, mut sum) = (0.0f64, 0.0f64, 0.0);
    for (input, output) in inputs.iter().zip(&outputs) {
        let d = input.truncate().as_dvec3();
        let unpacked = output.unpacked.truncate().as_dvec3();
        let error = angle(d, unpacked);
        assert!(
            error < 6.54e-5,
            "{input} is packed to {:#x}, {} unpacked: off by {error:e} rad, expected below 6.54e-5",
            output.packed,
            output.unpacked.truncate()
        );
        assert!(
            (unpacked.length() - 1.0).abs() < 4e-7,
            "{input} is unpacked to {} of length {}, expected 1 within 4e-7",
            output.unpacked.truncate(),
            unpacked.length()
        );
        // Both maps in f32, without rounding to 16 bits: about 8 operations of 6e-8 at a
        // stretch of √6.
        let error_map = angle(d, output.mapped.truncate().as_dvec3());
        assert!(
            error_map < 1e-6,
            "{input} is mapped there and back to {}: off by {error_map:e} rad, expected below 1e-6",
            output.mapped.truncate()
        );
        assert!(
            output.point.iter().all(|x| x.abs() <= 1.0),
            "octahedral coordinates of {input} are {:?}, expected within −1 to 1",
            output.point
        );
        worst = worst.max_nan(error);
        worst_map = worst_map.max(error_map);
        sum += error;
    }
    eprintln!(
        "octahedral: worst {worst:e} rad, mean {:e}, unrounded {worst_map:e}",
        sum / inputs.len() as f64
    );
    // The axes are exact.
    let axes: Vec<Vec4> = (0..6)
        .map(|i| {
            let mut axis = Vec4::ZERO;
            axis[i / 2] = if i % 2 == 0 { 1.0 } else { -1.0 };
            axis
        })
        .collect();
    let outputs: Vec<Octahedral> = map(OCTAHEDRAL, &axes);
    for (axis, output) in axes.iter().zip(&outputs) {
        assert_eq!(output.unpacked.truncate(), axis.truncate(), "axis, packed and unpacked");
    }
}

/// A direction that was unpacked packs to the same direction again, for any word.
#[test]
fn octahedral_words_survive_unpacking() {
    let mut inputs = words(30_000, 7);
    for x in [0x8000u32, 0x8001, 0xffff, 0, 1, 0x7fff, 0x4000, 0xc000] {
        inputs
            .extend([0x8000u32, 0x8001, 0xffff, 0, 1, 0x7fff, 0x4000, 0xc000].map(|y| x | y << 16));
    }
    let outputs: Vec<[Vec4; 2]> = map(
        "#import lucerna::math::octahedral::{pack_direction, unpack_direction}
        alias Input = u32;
        alias Output = array<vec4<f32>, 2>;
        fn map(input: Input) -> Output {
            let once = unpack_direction(input);
            return array<vec4<f32>, 2>(vec4<f32>(once, 0.0), vec4<f32>(unpack_direction(pack_direction(once)), 0.0));
        }",
        &inputs,
    );
    for (input, [once, twice]) in inputs.iter().zip(&outputs) {
        // Oracle of the published map, for the 16-bit numbers in f64.
        let [x, y] =
            [*input as i16, (*input >> 16) as i16].map(|v| (f64::from(v) / 32767.0).max(-1.0));
        let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        let z = 1.0 - x.abs() - y.abs();
        let expected = if z >= 0.0 {
            DVec3::new(x, y, z)
        } else {
            DVec3::new((1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y), z)
        };
        let [once, twice] = [once, twice].map(|v| v.truncate().as_dvec3());
        assert!(
            angle(once, expected) < 1e-6,
            "{input:#x} is unpacked to {once}, expected {expected} within 1e-6 rad"
        );
        assert!(
            angle(once, twice) < 1e-6,
            "{input:#x} is unpacked to {once}, and packed and unpacked again to {twice}, expected within 1e-6 rad"
        );
    }
}

/// Every byte survives; other numbers go to the nearest (either one within 1e-4 of a tie).
#[test]
fn unorm_bytes_are_nearest() {
    let mut random = Random(8);
    let mut inputs: Vec<Vec4> = (0..256)
        .map(|i| {
            Vec4::from_array([0, 85, 170, 255].map(|offset| ((i + offset) % 256) as f32 / 255.0))
        })
        .collect();
    inputs.push(Vec4::new(-1.0, 2.0, f32::INFINITY, f32::NEG_INFINITY));
    inputs.push(Vec4::new(-0.0, 1e-40, f32::MAX, f32::MIN));
    for _ in 0..10_000 {
        inputs.push(Vec4::from_array([(); 4].map(|()| random.range(-0.1, 1.1))));
    }
    let outputs: Vec<[u32; 8]> = map(
        "#import lucerna::math::unorm::{pack_unorm, unpack_unorm}
        alias Input = vec4<f32>;
        struct Output { packed: vec4<u32>, unpacked: vec4<f32> }
        fn map(input: Input) -> Output {
            let packed = pack_unorm(input);
            return Output(vec4<u32>(packed, pack_unorm(unpack_unorm(packed)), 0u, 0u), unpack_unorm(packed));
        }",
        &inputs,
    );
    for (input, output) in inputs.iter().zip(&outputs) {
        assert_eq!(output[0], output[1], "{input}: bytes, and the bytes unpacked and packed again");
        for (axis, byte) in output[0].to_le_bytes().into_iter().enumerate() {
            let exact = f64::from(input[axis]).clamp(0.0, 1.0) * 255.0;
            assert!(
                (exact - f64::from(byte)).abs() < 0.5 + 1e-4,
                "{input}: byte {axis} is {byte}, expected {exact} within 0.5001"
            );
            let unpacked = f64::from(f32::from_bits(output[4 + axis]));
            // One division.
            assert!(
                (unpacked - f64::from(byte) / 255.0).abs() < 2e-7,
                "{input}: byte {axis}, {byte}, is unpacked to {unpacked}, expected {} within 2e-7",
                f64::from(byte) / 255.0
            );
        }
    }
}

/// Value of a half, from the definition.
fn half(bits: u16) -> f64 {
    let mantissa = f64::from(bits & 0x3ff);
    let magnitude = match (bits >> 10) & 31 {
        0 => mantissa * 2f64.powi(-24),
        exponent => (1.0 + mantissa / 1024.0) * 2f64.powi(i32::from(exponent) - 15),
    };
    if bits & 0x8000 != 0 { -magnitude } else { magnitude }
}

/// Either neighbour is right (WGSL leaves the rounding to the device): below 2⁻¹⁰ of the number, and
/// where halves are subnormal below their spacing, or all of it on a device that flushes.
#[test]
fn halves_are_neighbours_and_never_infinite() {
    let mut inputs = words(30_000, 9);
    inputs.extend(positive_words(10_000, 10).iter().flat_map(|&w| [w, w | 0x8000_0000]));
    inputs.resize(inputs.len().next_multiple_of(2), 0);
    let pairs: Vec<[u32; 2]> = inputs.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
    let packed: Vec<u32> = map(
        "#import lucerna::math::half::pack_half
        alias Input = vec2<u32>;
        alias Output = u32;
        fn map(input: Input) -> Output { return pack_half(bitcast<vec2<f32>>(input)); }",
        &pairs,
    );
    // In a dispatch of its own: where both follow each other drivers leave both out.
    let unpacked: Vec<[f32; 2]> = map(
        "#import lucerna::math::half::unpack_half
        alias Input = u32;
        alias Output = vec2<f32>;
        fn map(input: Input) -> Output { return unpack_half(input); }",
        &packed,
    );
    let mut worst = 0.0f64;
    for (ix, pair) in pairs.iter().enumerate() {
        for lane in 0..2 {
            let x = f32::from_bits(pair[lane]);
            let bits = (packed[ix] >> (16 * lane)) as u16;
            let exact = if x.is_nan() { 0.0 } else { f64::from(x.clamp(-65504.0, 65504.0)) };
            assert!(bits & 0x7c00 != 0x7c00, "{x:?} is packed to {bits:#06x}, which is not finite");
            let error = (half(bits) - exact).abs();
            let normal = exact.abs() >= 2f64.powi(-14);
            let bound = if normal { exact.abs() * 2f64.powi(-10) } else { 2f64.powi(-14) };
            assert!(
                error <= bound,
                "{x:?} is packed to {bits:#06x}, {}, expected {exact}: off by {error:e}, expected at most {bound:e}",
                half(bits)
            );
            if normal {
                worst = worst.max_nan(error / exact.abs());
            }
            let unpacked = f64::from(unpacked[ix][lane]);
            let flushed = unpacked == 0.0 && bits & 0x7c00 == 0;
            assert!(
                unpacked == half(bits) || flushed,
                "{bits:#06x} is unpacked to {unpacked}, expected {} (or 0 for a subnormal one)",
                half(bits)
            );
            if exact == half(bits) && exact != 0.0 {
                assert_eq!(
                    x < 0.0,
                    bits >> 15 == 1,
                    "{x:?} is packed to {bits:#06x}: whether each is negative"
                );
            }
        }
    }
    eprintln!("half: worst relative error {worst:e} (2^-11 is {:e})", 2f64.powi(-11));
}

/// Every number of one component's format, ascending: value of bits `0..(31 << mantissa_bits)`.
fn small_floats(mantissa_bits: u32) -> Vec<f64> {
    let steps = f64::from(1u32 << mantissa_bits);
    (0..31u32 << mantissa_bits)
        .map(|bits| {
            let mantissa = f64::from(bits & ((1 << mantissa_bits) - 1)) / steps;
            match bits >> mantissa_bits {
                0 => mantissa * 2f64.powi(-14),
                exponent => (1.0 + mantissa) * 2f64.powi(exponent as i32 - 15),
            }
        })
        .collect()
}

/// Index of the nearest number; of two, the even one. By search, not by shifts.
fn nearest_even(numbers: &[f64], x: f64) -> u32 {
    let above = numbers.partition_point(|&n| n < x);
    if above == 0 || above == numbers.len() {
        return above.min(numbers.len() - 1) as u32;
    }
    let (down, up) = (x - numbers[above - 1], numbers[above] - x);
    (if down < up || (down == up && above % 2 == 1) { above - 1 } else { above }) as u32
}

/// Bits equal those of a search through all numbers of the format.
#[test]
fn small_floats_are_nearest_even() {
    let mut inputs = words(30_000, 11);
    inputs.extend(positive_words(10_000, 12));
    for x in [
        65023f32,
        65024.0,
        65280.0,
        64511.0,
        64512.0,
        65536.0,
        6.1e-5,
        2f32.powi(-14),
        2e-6,
        4.7e-7,
        1e-7,
    ] {
        inputs.extend([x.to_bits(); 3]);
    }
    // The middles between neighbours, exactly.
    for numbers in [small_floats(6), small_floats(5)] {
        for pair in numbers.windows(2) {
            let middle = ((pair[0] + pair[1]) / 2.0) as f32;
            inputs.extend([middle.to_bits(); 3]);
        }
    }
    let inputs = triples(&inputs);
    let outputs: Vec<[u32; 4]> = map(
        "#import lucerna::math::small_float::{pack_small_float, unpack_small_float}
        alias Input = vec4<u32>;
        alias Output = vec4<u32>;
        fn map(input: Input) -> Output {
            let packed = pack_small_float(bitcast<vec3<f32>>(input.xyz));
            return vec4<u32>(bitcast<vec3<u32>>(unpack_small_float(packed)), packed);
        }",
        &inputs,
    );
    let tables = [small_floats(6), small_floats(6), small_floats(5)];
    for (input, output) in inputs.iter().zip(&outputs) {
        let mut expected = 0;
        for (lane, shift) in [0, 11, 22].into_iter().enumerate() {
            let x = f32::from_bits(input[lane]);
            // NaN compares false and becomes 0.
            let ix = nearest_even(&tables[lane], if x > 0.0 { f64::from(x) } else { 0.0 });
            expected |= ix << shift;
            let value = f64::from(f32::from_bits(output[lane]));
            assert_eq!(
                value, tables[lane][ix as usize],
                "{x:?} in lane {lane}, packed and unpacked"
            );
        }
        assert_eq!(
            output[3], expected,
            "{input:x?} is packed to {:#x}, expected {expected:#x}",
            output[3]
        );
    }
}

/// Words from elsewhere: exponent 31 is infinity or NaN; the example of the module's header.
#[test]
fn small_floats_unpack_specials() {
    let inputs = [
        0x781e_03c0u32,
        31 << 6 | 31 << 17 | 31 << 27,
        31 << 6 | 1 | (31 << 6 | 63) << 11 | (31 << 5 | 1) << 22,
    ];
    let outputs: Vec<[f32; 4]> = map(
        "#import lucerna::math::small_float::unpack_small_float
        alias Input = u32;
        alias Output = vec4<f32>;
        fn map(input: Input) -> Output { return vec4<f32>(unpack_small_float(input), 0.0); }",
        &inputs,
    );
    assert_eq!(outputs[0][..3], [1.0; 3], "the example of the module's header, unpacked");
    assert_eq!(outputs[1][..3], [f32::INFINITY; 3], "exponent 31 with mantissa 0, unpacked");
    assert_each(
        "exponent 31 with other mantissas, unpacked: numbers",
        &outputs[2][..3],
        "NaN",
        |x| x.is_nan(),
    );
}

/// EXT_texture_shared_exponent in f64, by its text.
fn shared_exponent(v: [f32; 3]) -> u32 {
    // NaN compares false and becomes 0.
    let c = v.map(|x| if x > 0.0 { f64::from(x).min(65408.0) } else { 0.0 });
    let largest = c.into_iter().fold(0.0, f64::max);
    let mut log = -16;
    while log < 15 && largest >= 2f64.powi(log + 1) {
        log += 1;
    }
    let preliminary = log + 1 + 15;
    let mantissa = |x: f64, exponent: i32| (x / 2f64.powi(exponent - 15 - 9) + 0.5).floor() as u32;
    let exponent = preliminary + i32::from(mantissa(largest, preliminary) == 512);
    let [x, y, z] = c.map(|x| mantissa(x, exponent));
    x | y << 9 | z << 18 | (exponent as u32) << 27
}

/// Bits equal the extension's algorithm; the error is the documented one.
#[test]
fn shared_exponents_follow_the_extension() {
    let mut inputs = triples(&words(30_000, 13));
    let mut random = Random(14);
    let mut push = |v: [f32; 3]| {
        for rotation in 0..3 {
            let mut v = v;
            v.rotate_left(rotation);
            inputs.push([v[0].to_bits(), v[1].to_bits(), v[2].to_bits(), 0]);
        }
    };
    for _ in 0..20_000 {
        let scale = 2f32.powf(random.range(-30.0, 18.0));
        push([(); 3].map(|()| random.unit() * scale));
    }
    // Ties, their neighbours, and mantissas that round up to the next exponent.
    for exponent in -25..17 {
        let step = 2f32.powi(exponent);
        for mantissa in [
            0.49999997f32,
            0.5,
            0.500_000_06,
            1.5,
            255.5,
            255.49998,
            510.5,
            511.0,
            511.49997,
            511.5,
            511.50003,
            512.0,
        ] {
            push([mantissa * step, 511.0 * step, 0.0]);
            push([mantissa * step, 300.0 * step, 0.5 * step]);
            push([mantissa * step, 0.0, f32::NAN]);
        }
    }
    for x in [
        65408.0,
        65407.9,
        65500.0,
        f32::INFINITY,
        f32::MAX,
        -1.0,
        f32::NEG_INFINITY,
        0.0,
        -0.0,
        1e-40,
    ] {
        push([x, 1.0, 0.0]);
        push([x; 3]);
    }
    let outputs: Vec<[u32; 4]> = map(
        "#import lucerna::math::shared_exponent::{pack_shared_exponent, unpack_shared_exponent}
        alias Input = vec4<u32>;
        alias Output = vec4<u32>;
        fn map(input: Input) -> Output {
            let packed = pack_shared_exponent(bitcast<vec3<f32>>(input.xyz));
            return vec4<u32>(bitcast<vec3<u32>>(unpack_shared_exponent(packed)), packed);
        }",
        &inputs,
    );
    assert_eq!(shared_exponent([1.0; 3]), 0x8402_0100, "the example of the module's header");
    for (input, output) in inputs.iter().zip(&outputs) {
        let v = [input[0], input[1], input[2]].map(f32::from_bits);
        let expected = shared_exponent(v);
        assert_eq!(
            output[3], expected,
            "{v:?} is packed to {:#x}, expected {expected:#x}",
            output[3]
        );
        let clamped = v.map(|x| if x > 0.0 { f64::from(x).min(65408.0) } else { 0.0 });
        let largest = clamped.into_iter().fold(0.0, f64::max);
        for lane in 0..3 {
            let value = f64::from(f32::from_bits(output[lane]));
            let mantissa = f64::from(expected >> (9 * lane) & 511);
            assert_eq!(
                value,
                mantissa * 2f64.powi((expected >> 27) as i32 - 24),
                "{expected:#x}, unpacked, lane {lane}"
            );
            let bound = (largest / 511.0).max(2f64.powi(-25));
            assert!(
                (value - clamped[lane]).abs() <= bound,
                "{v:?} becomes {value} in lane {lane}, expected {} within {bound:e}",
                clamped[lane]
            );
        }
    }
}

/// Exact, against a loop over bits; both ways.
#[test]
fn morton_codes_interleave_bits() {
    let mut random = Random(15);
    let mut inputs: Vec<[u32; 4]> = Vec::new();
    for a in [0, 1, 0x3ff, 0x400, 0xffff, 0x1_0000, u32::MAX] {
        for b in [0, 1, 0x3ff, 0xffff, u32::MAX] {
            inputs.push([a, b, a ^ b, a.rotate_left(16) ^ b]);
        }
    }
    for bit in 0..32 {
        inputs.extend([[1 << bit, 0, 0, 1 << bit], [0, 1 << bit, 0, 0], [0, 0, 1 << bit, 0]]);
    }
    inputs.extend(std::iter::repeat_with(|| [(); 4].map(|()| random.bits() as u32)).take(10_000));
    let outputs: Vec<[u32; 8]> = map(
        "#import lucerna::math::morton::{morton_encode_2d, morton_decode_2d, morton_encode_3d, morton_decode_3d}
        alias Input = vec4<u32>;
        alias Output = array<u32, 8>;
        fn map(input: Input) -> Output {
            let flat = morton_decode_2d(input.w);
            let solid = morton_decode_3d(input.w);
            return array<u32, 8>(
                morton_encode_2d(input.xy), morton_encode_3d(input.xyz),
                flat.x, flat.y, solid.x, solid.y, solid.z, 0u,
            );
        }",
        &inputs,
    );
    let encode = |axes: &[u32], bits: usize| {
        let n = axes.len();
        (0..bits * n).fold(0u32, |code, bit| code | (axes[bit % n] >> (bit / n) & 1) << bit)
    };
    let decode = |code: u32, axis: usize, n: usize, bits: usize| {
        (0..bits).fold(0u32, |value, bit| value | (code >> (bit * n + axis) & 1) << bit)
    };
    for (input, output) in inputs.iter().zip(&outputs) {
        let code = input[3];
        let expected = [
            encode(&input[..2], 16),
            encode(&input[..3], 10),
            decode(code, 0, 2, 16),
            decode(code, 1, 2, 16),
            decode(code, 0, 3, 10),
            decode(code, 1, 3, 10),
            decode(code, 2, 3, 10),
            0,
        ];
        assert_eq!(
            *output, expected,
            "Morton codes of the first two and three of {input:x?}, and the last one decoded"
        );
    }
}
