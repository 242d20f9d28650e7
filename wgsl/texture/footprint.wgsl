// SPDX-License-Identifier: MIT OR Apache-2.0
//! The footprint of a sample on a texture, and the mip that matches it.
//!
//! A footprint on a triangle is the change of the weights of its second and third corner to the next sample: xy to the
//! right, zw down. Texture coordinates are linear in the weights, so this also gives the footprint on every texture of
//! the triangle.
#define_import_path lucerna::texture::footprint

#import lucerna::math::vector::safe_normalize

/// Level of detail: log₂ of the texels that a sample covers along its longer side, not below 0
/// (OpenGL 4.6 §8.14: ρ = max(|∂/∂x|, |∂/∂y|)).
///
/// `texels_x`, `texels_y`: distance to the next sample to the right and down, in texels.
fn texture_level(texels_x: vec2<f32>, texels_y: vec2<f32>) -> f32 {
    let square = max(dot(texels_x, texels_x), dot(texels_y, texels_y));
    return select(0.0, 0.5 * log2(square), square > 1.0);
}

/// Two mips to read for a fractional level of detail.
struct MipPair {
    /// The finer one; the other is the next.
    first: u32,
    /// Their weights, which sum to 1. A mip with the weight 0 need not exist.
    weights: vec2<f32>,
}

/// The mips nearest to a level of detail, for trilinear filtering. `level` ≥ 0; beyond 32 (images have at most 2³² texels
/// a side) the coarsest has all the weight.
fn mips_between(level: f32) -> MipPair {
    let first = min(u32(level), 31u);
    let share = clamp(level - f32(first), 0.0, 1.0);
    return MipPair(first, vec2<f32>(1.0 - share, share));
}

/// The footprint of a square of this width [m] on a triangle with the edges `to_b` = b − a and `to_c` = c − a [m]: with N = e₁ × e₂, a
/// step d changes the weights by ((d × e₂)·N, (e₁ × d)·N)/N². Zeros for a triangle without area.
fn footprint_of_width(to_b: vec3<f32>, to_c: vec3<f32>, width: f32) -> vec4<f32> {
    let normal = cross(to_b, to_c);
    let square = dot(normal, normal);
    let along = safe_normalize(to_b, vec3<f32>(0.0)) * width;
    let across = safe_normalize(cross(normal, to_b), vec3<f32>(0.0)) * width;
    if !(square > 0.0) {
        return vec4<f32>(0.0);
    }
    return vec4<f32>(
        dot(cross(along, to_c), normal),
        dot(cross(to_b, along), normal),
        dot(cross(across, to_c), normal),
        dot(cross(to_b, across), normal),
    ) / square;
}
