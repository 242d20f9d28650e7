// SPDX-License-Identifier: MIT OR Apache-2.0
//! A small square map of all directions around a probe, without a border.
//!
//! The octahedral mapping (`lucerna::math::octahedral`; C. Cigolle et al., 2014) unfolded to MAP_SIDE × MAP_SIDE texels, as in Z.
//! Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019. There, texels of a
//! border repeat those beyond the fold; here, look-ups fold their taps, so that a probe's texels are exactly MAP_SIDE².
#define_import_path lucerna::components::probes::octahedral_map

#import lucerna::math::octahedral::{direction_from_octahedral, octahedral_from_direction}

/// Texels along each side.
const MAP_SIDE: u32 = 8u;

/// The four texels around a direction, with weights that sum to 1.
struct MapTaps {
    texels: vec4<u32>,
    weights: vec4<f32>,
}

/// The direction (unit length) of a point of a texel; `inside`: from the texel's corner, in [0, 1]², (0.5, 0.5) its middle.
fn direction_of_texel(texel: u32, inside: vec2<f32>) -> vec3<f32> {
    let corner = vec2<f32>(vec2<u32>(texel % MAP_SIDE, texel / MAP_SIDE));
    return direction_from_octahedral((corner + inside) * (2.0 / f32(MAP_SIDE)) - 1.0);
}

/// The index of a texel that may be one beyond the map's edge: there, the map continues at the same edge, mirrored about its
/// middle; beyond a corner it continues at the opposite one.
fn folded_texel(texel: vec2<i32>) -> u32 {
    let last = i32(MAP_SIDE) - 1;
    var at = texel;
    if at.x < 0 || at.x > last {
        at = vec2<i32>(clamp(at.x, 0, last), last - at.y);
    }
    if at.y < 0 || at.y > last {
        at = vec2<i32>(last - at.x, clamp(at.y, 0, last));
    }
    return u32(at.y) * MAP_SIDE + u32(at.x);
}

/// The texels around a direction (not zero), for bilinear interpolation.
fn map_taps(direction: vec3<f32>) -> MapTaps {
    let point = (octahedral_from_direction(direction) * 0.5 + 0.5) * f32(MAP_SIDE) - 0.5;
    let base = floor(point);
    let upper = point - base;
    let lower = 1.0 - upper;
    let corner = vec2<i32>(base);
    return MapTaps(
        vec4<u32>(
            folded_texel(corner),
            folded_texel(corner + vec2<i32>(1, 0)),
            folded_texel(corner + vec2<i32>(0, 1)),
            folded_texel(corner + vec2<i32>(1, 1)),
        ),
        vec4<f32>(lower.x * lower.y, upper.x * lower.y, lower.x * upper.y, upper.x * upper.y),
    );
}
