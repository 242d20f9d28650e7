// SPDX-License-Identifier: MIT OR Apache-2.0
//! Normal maps in tangent space (glTF 2.0 §3.9.3).
#define_import_path lucerna::texture::normal_map

#import lucerna::math::vector::safe_normalize

/// The normal of a map's texel, unit length: 2·texel − 1, x and y scaled, in the frame of the interpolated tangent, bitangent and
/// normal.
///
/// `texel`: in [0, 1]³; `normal`: unit length; `tangent`: interpolated, of any length and not exactly perpendicular to
/// the normal; if it is zero or along the normal, x and y of the texel have no effect. `is_mirrored`: whether the
/// bitangent is reversed (glTF's w = −1).
fn normal_of_map(
    texel: vec3<f32>,
    scale: f32,
    normal: vec3<f32>,
    tangent: vec3<f32>,
    is_mirrored: bool,
) -> vec3<f32> {
    let right = safe_normalize(tangent - normal * dot(tangent, normal), vec3<f32>(0.0));
    let up = cross(normal, right) * select(1.0, -1.0, is_mirrored);
    let unpacked = texel * 2.0 - 1.0;
    let local = vec3<f32>(unpacked.xy * scale, unpacked.z);
    return safe_normalize(right * local.x + up * local.y + normal * local.z, normal);
}
