// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: spherical harmonics of order 2 of the luma, and of order 1 of two differences of colour, as halfs. 36 bytes
//! with their exponent.
//!
//! Colours are Y Co Cg (H. Malvar, G. Sullivan, "YCoCg-R", JVT-I014, 2003), because eyes see brightness more sharply than hue. Its fault:
//! where lights of opposite hues come from opposite sides, their hues are blurred.
//! Interface: `WORDS`, `pack_light`, `unpack_light`.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::probe_light::{CHROMA, NUMBERS, ProbeLight}
#import lucerna::components::probes::scaled_halfs::{exponent_of, packing_factor, unpacking_factor}
#import lucerna::math::half::{pack_half, unpack_half}

/// Words of a probe.
const WORDS: u32 = 9u;

/// `radiance`: coefficients of order 2 [W·sr⁻¹·m⁻²]. An error is at most 2⁻¹⁰ of the largest number.
fn pack_light(radiance: array<vec3<f32>, 9>) -> array<u32, WORDS> {
    var c = radiance;
    var numbers: array<f32, 2u * WORDS>;
    var largest = 0.0;
    for (var k = 0u; k < 9u; k++) {
        numbers[k] = dot(c[k], vec3<f32>(0.25, 0.5, 0.25));
        largest = max(largest, abs(numbers[k]));
    }
    for (var k = 0u; k < CHROMA; k++) {
        let orange = dot(c[k], vec3<f32>(0.5, 0.0, -0.5));
        let green = dot(c[k], vec3<f32>(-0.25, 0.5, -0.25));
        numbers[9u + k] = orange;
        numbers[9u + CHROMA + k] = green;
        largest = max(largest, max(abs(orange), abs(green)));
    }
    let exponent = exponent_of(largest);
    let factor = packing_factor(exponent);
    var words: array<u32, WORDS>;
    for (var k = 0u; k < WORDS; k++) {
        words[k] = pack_half(vec2<f32>(numbers[2u * k], numbers[2u * k + 1u]) * factor);
    }
    // (The last half is free.)
    words[WORDS - 1u] = (words[WORDS - 1u] & 0xffffu) | (exponent << 16u);
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    let factor = unpacking_factor(words[WORDS - 1u] >> 16u);
    var light: ProbeLight;
    for (var k = 0u; k < WORDS - 1u; k++) {
        let two = unpack_half(words[k]) * factor;
        light.numbers[2u * k] = two.x;
        light.numbers[2u * k + 1u] = two.y;
    }
    light.numbers[NUMBERS - 1u] = unpack_half(words[WORDS - 1u] & 0xffffu).x * factor;
    return light;
}
