// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: spherical harmonics of order 4 without band 3, as halfs. 112 bytes with their exponent.
//!
//! Interface: `WORDS`, `pack_light`, `unpack_light`.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::bands::KEPT_COEFFICIENTS
#import lucerna::components::probes::probe_light::ProbeLight
#import lucerna::components::probes::scaled_halfs::{exponent_of, packing_factor, unpacking_factor}
#import lucerna::math::half::{pack_half, unpack_half}

/// Words of a probe.
const WORDS: u32 = 28u;

/// `radiance`: coefficients of the bands 0 to 2 and 4 [W·sr⁻¹·m⁻²]. An error is at most 2⁻¹⁰ of the largest coefficient.
fn pack_light(radiance: array<vec3<f32>, KEPT_COEFFICIENTS>) -> array<u32, WORDS> {
    var c = radiance;
    var largest = 0.0;
    for (var k = 0u; k < KEPT_COEFFICIENTS; k++) {
        largest = max(largest, max(abs(c[k].x), max(abs(c[k].y), abs(c[k].z))));
    }
    let exponent = exponent_of(largest);
    let factor = packing_factor(exponent);
    var words: array<u32, WORDS>;
    // Two colours are three words.
    for (var k = 0u; k < KEPT_COEFFICIENTS / 2u; k++) {
        let a = c[2u * k] * factor;
        let b = c[2u * k + 1u] * factor;
        words[3u * k] = pack_half(a.xy);
        words[3u * k + 1u] = pack_half(vec2<f32>(a.z, b.x));
        words[3u * k + 2u] = pack_half(b.yz);
    }
    words[WORDS - 1u] = exponent;
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    let factor = unpacking_factor(words[WORDS - 1u]);
    var light: ProbeLight;
    for (var k = 0u; k < KEPT_COEFFICIENTS / 2u; k++) {
        let a = unpack_half(words[3u * k]);
        let b = unpack_half(words[3u * k + 1u]);
        let c = unpack_half(words[3u * k + 2u]);
        light.coefficients[2u * k] = vec3<f32>(a, b.x) * factor;
        light.coefficients[2u * k + 1u] = vec3<f32>(b.y, c) * factor;
    }
    return light;
}
