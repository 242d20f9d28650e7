// SPDX-License-Identifier: MIT OR Apache-2.0
//! Unit vectors as two 16-bit signed normalised numbers.
//!
//! Z. Cigolle et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT
//! 3(2), 2014, octahedral mapping ("oct32").
//!
//! The error of a direction is at most 6.5e-5 rad (0.0037°; by geometry √18/65534), and 2.3e-5 rad
//! on average over the sphere; the six axes are exact.
#define_import_path lucerna::math::octahedral

/// Projects a direction onto the octahedron and unfolds it to the square [−1, 1]².
///
/// `direction`: not zero; its length does not matter, as long as |x| + |y| + |z| is in [1e-30,
/// 1e38].
fn octahedral_from_direction(direction: vec3<f32>) -> vec2<f32> {
    let p = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2<f32>(-1.0), vec2<f32>(1.0), p.xy >= vec2<f32>(0.0));
    return select(p.xy, folded, p.z < 0.0);
}

/// The unit vector of a point of the square [−1, 1]².
fn direction_from_octahedral(point: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(point.x) - abs(point.y);
    let fold = max(-z, 0.0);
    let xy = point - fold * select(vec2<f32>(-1.0), vec2<f32>(1.0), point >= vec2<f32>(0.0));
    return normalize(vec3<f32>(xy, z));
}

/// A direction (not zero) as 2×16 bits, x in the low half.
fn pack_direction(direction: vec3<f32>) -> u32 {
    return pack2x16snorm(octahedral_from_direction(direction));
}

/// The unit vector of [`pack_direction`]. Every word is valid; lengths are 1 to 4e-7.
fn unpack_direction(packed: u32) -> vec3<f32> {
    return direction_from_octahedral(unpack2x16snorm(packed));
}
