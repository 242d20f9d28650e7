// SPDX-License-Identifier: MIT OR Apache-2.0
//! A mask of the directions in which a probe sees the sky: a bit for each texel of an octahedral map.
#define_import_path lucerna::components::sparse_probes::sky_mask

#import lucerna::math::octahedral::{direction_from_octahedral, octahedral_from_direction}

/// Texels along each side of the map.
const SKY_MASK_SIDE: u32 = 128u;
/// Words of a probe's mask.
const SKY_MASK_WORDS: u32 = 512u;
const_assert SKY_MASK_WORDS * 32u == SKY_MASK_SIDE * SKY_MASK_SIDE;

/// The texel of a direction, unit length.
fn sky_mask_texel(direction: vec3<f32>) -> u32 {
    let at = (octahedral_from_direction(direction) * 0.5 + 0.5) * f32(SKY_MASK_SIDE);
    let texel = min(vec2<u32>(max(at, vec2<f32>(0.0))), vec2<u32>(SKY_MASK_SIDE - 1u));
    return texel.y * SKY_MASK_SIDE + texel.x;
}

/// The direction of a texel's centre, unit length.
fn sky_mask_direction(texel: u32) -> vec3<f32> {
    let at = vec2<f32>(vec2<u32>(texel % SKY_MASK_SIDE, texel / SKY_MASK_SIDE)) + 0.5;
    return direction_from_octahedral(at / (0.5 * f32(SKY_MASK_SIDE)) - 1.0);
}
