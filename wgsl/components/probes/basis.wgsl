// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: spherical harmonics of order 2, as halfs. 54 bytes, and two for their exponent.
//!
//! Interface: `WORDS`, `pack_light`, `unpack_light`. Other bases are the variants
//! `basis`.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::probe_light::ProbeLight
#import lucerna::components::probes::scaled_halfs::{exponent_of, packing_factor, unpacking_factor}
#import lucerna::math::half::{pack_half, unpack_half}

/// Words of a probe.
const WORDS: u32 = 14u;

/// `radiance`: coefficients of order 2 [W·sr⁻¹·m⁻²]. An error is at most 2⁻¹⁰ of the largest coefficient.
fn pack_light(radiance: array<vec3<f32>, 9>) -> array<u32, WORDS> {
    var c = radiance;
    var largest = 0.0;
    for (var k = 0u; k < 9u; k++) {
        largest = max(largest, max(abs(c[k].x), max(abs(c[k].y), abs(c[k].z))));
    }
    let exponent = exponent_of(largest);
    let factor = packing_factor(exponent);
    var words: array<u32, WORDS>;
    for (var k = 0u; k < WORDS; k++) {
        let a = 2u * k;
        let first = c[a / 3u][a % 3u] * factor;
        if a == 26u {
            words[k] = pack_half(vec2<f32>(first, 0.0)) | (exponent << 16u);
        } else {
            words[k] = pack_half(vec2<f32>(first, c[(a + 1u) / 3u][(a + 1u) % 3u] * factor));
        }
    }
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    let factor = unpacking_factor(words[WORDS - 1u] >> 16u);
    var light: ProbeLight;
    // Two colours are three words.
    for (var k = 0u; k < 4u; k++) {
        let a = unpack_half(words[3u * k]);
        let b = unpack_half(words[3u * k + 1u]);
        let c = unpack_half(words[3u * k + 2u]);
        light.coefficients[2u * k] = vec3<f32>(a, b.x) * factor;
        light.coefficients[2u * k + 1u] = vec3<f32>(b.y, c) * factor;
    }
    let last = unpack_half(words[WORDS - 1u] & 0xffffu).x;
    light.coefficients[8] = vec3<f32>(unpack_half(words[WORDS - 2u]), last) * factor;
    return light;
}
