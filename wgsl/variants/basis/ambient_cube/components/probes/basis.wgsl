// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe holds: the irradiance along the six axes, as halfs. 40 bytes with their exponent.
//!
//! The ambient cube of J. Mitchell, G. McTaggart, C. Green, "Shading in Valve's Source Engine", SIGGRAPH 2006. Interface: `WORDS`,
//! `ProbeLight`, `pack_light`, `unpack_light`, `add_probe_light`, `light_irradiance`.
#define_import_path lucerna::components::probes::basis

#import lucerna::components::probes::probe_light::ProbeLight
#import lucerna::components::probes::scaled_halfs::{exponent_of, packing_factor, unpacking_factor}
#import lucerna::components::voxels::grid::face_normal
#import lucerna::math::half::{pack_half, unpack_half}
#import lucerna::sh::convolve::sh2_irradiance

/// Words of a probe.
const WORDS: u32 = 10u;

/// `radiance`: coefficients of order 2 [W·sr⁻¹·m⁻²]. The irradiance along the axes is theirs, to 2⁻¹⁰ of the largest.
fn pack_light(radiance: array<vec3<f32>, 9>) -> array<u32, WORDS> {
    var faces: array<vec3<f32>, 6>;
    var largest = 0.0;
    for (var k = 0u; k < 6u; k++) {
        faces[k] = sh2_irradiance(radiance, face_normal(k));
        largest = max(largest, max(abs(faces[k].x), max(abs(faces[k].y), abs(faces[k].z))));
    }
    let exponent = exponent_of(largest);
    let factor = packing_factor(exponent);
    var words: array<u32, WORDS>;
    for (var k = 0u; k < 9u; k++) {
        let a = 2u * k;
        words[k] = pack_half(vec2<f32>(faces[a / 3u][a % 3u], faces[(a + 1u) / 3u][(a + 1u) % 3u]) * factor);
    }
    words[9] = exponent;
    return words;
}

/// The light of [`pack_light`].
fn unpack_light(packed: array<u32, WORDS>) -> ProbeLight {
    var words = packed;
    let factor = unpacking_factor(words[9]);
    var light: ProbeLight;
    // Two colours are three words.
    for (var k = 0u; k < 3u; k++) {
        let a = unpack_half(words[3u * k]);
        let b = unpack_half(words[3u * k + 1u]);
        let c = unpack_half(words[3u * k + 2u]);
        light.faces[2u * k] = vec3<f32>(a, b.x) * factor;
        light.faces[2u * k + 1u] = vec3<f32>(b.y, c) * factor;
    }
    return light;
}
