// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: spherical harmonics of order 2, as they were gathered. 108 bytes.
//!
//! Interface: `WORDS`, `pack_light`, `unpack_light`.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::probe_light::ProbeLight

/// Words of a probe.
const WORDS: u32 = 27u;

/// `radiance`: coefficients of order 2 [W·sr⁻¹·m⁻²], kept exactly.
fn pack_light(radiance: array<vec3<f32>, 9>) -> array<u32, WORDS> {
    var c = radiance;
    var words: array<u32, WORDS>;
    for (var k = 0u; k < WORDS; k++) {
        words[k] = bitcast<u32>(c[k / 3u][k % 3u]);
    }
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    var light: ProbeLight;
    for (var k = 0u; k < 9u; k++) {
        light.coefficients[k] = bitcast<vec3<f32>>(vec3<u32>(words[3u * k], words[3u * k + 1u], words[3u * k + 2u]));
    }
    return light;
}
