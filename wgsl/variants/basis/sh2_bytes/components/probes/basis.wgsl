// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: spherical harmonics of order 2; the constant as halfs, the others as bytes, relative to it. 32 bytes.
//!
//! Interface: `WORDS`, `pack_light`, `unpack_light`. Radiance is nowhere below 0, so a
//! coefficient is at most max|Y(l, m)|/Y(0, 0) times the constant of its colour: bytes cover that range.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::probe_light::ProbeLight
#import lucerna::components::probes::scaled_halfs::{exponent_of, packing_factor, unpacking_factor}
#import lucerna::math::half::{pack_half, unpack_half}

/// Words of a probe.
const WORDS: u32 = 8u;

/// √3, √15/2 and √5: the largest value of each basis function after the first, in multiples of the first.
const LARGEST = array<f32, 8>(
    1.7320508, 1.7320508, 1.7320508, 1.9364917, 1.9364917, 2.236068, 1.9364917, 1.9364917,
);

/// `radiance`: coefficients of order 2 [W·sr⁻¹·m⁻²]. The constants' errors are at most 2⁻¹⁰ of the largest; those of the others at
/// most 1/254 of `LARGEST` times their constant, if radiance is nowhere below 0. Larger ones are cut.
fn pack_light(radiance: array<vec3<f32>, 9>) -> array<u32, WORDS> {
    var c = radiance;
    var largest = LARGEST;
    let constant = max(c[0], vec3<f32>(0.0));
    let exponent = exponent_of(max(constant.x, max(constant.y, constant.z)));
    let scaled = constant * packing_factor(exponent);
    var words: array<u32, WORDS>;
    words[0] = pack_half(scaled.xy);
    words[1] = pack_half(vec2<f32>(scaled.z, 0.0)) | (exponent << 16u);
    for (var k = 0u; k < 6u; k++) {
        var four: vec4<f32>;
        for (var j = 0u; j < 4u; j++) {
            let ix = 4u * k + j;
            let band = ix / 3u;
            let whole = constant[ix % 3u] * largest[band];
            four[j] = select(0.0, c[band + 1u][ix % 3u] / whole, whole > 0.0);
        }
        words[k + 2u] = pack4x8snorm(four);
    }
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    var largest = LARGEST;
    let factor = unpacking_factor(words[1] >> 16u);
    let constant = vec3<f32>(unpack_half(words[0]), unpack_half(words[1] & 0xffffu).x) * factor;
    var light: ProbeLight;
    light.coefficients[0] = constant;
    // Four colours are three words.
    for (var k = 0u; k < 2u; k++) {
        let a = unpack4x8snorm(words[3u * k + 2u]);
        let b = unpack4x8snorm(words[3u * k + 3u]);
        let c = unpack4x8snorm(words[3u * k + 4u]);
        light.coefficients[4u * k + 1u] = a.xyz * largest[4u * k] * constant;
        light.coefficients[4u * k + 2u] = vec3<f32>(a.w, b.xy) * largest[4u * k + 1u] * constant;
        light.coefficients[4u * k + 3u] = vec3<f32>(b.zw, c.x) * largest[4u * k + 2u] * constant;
        light.coefficients[4u * k + 4u] = c.yzw * largest[4u * k + 3u] * constant;
    }
    return light;
}
