// SPDX-License-Identifier: MIT OR Apache-2.0
//! Orthonormal frames.
//!
//! T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6(1), 2017, listing 3: no
//! singularity, no branch, right-handed.
#define_import_path lucerna::math::frame

/// A right-handed frame whose third column is `normal`: world_from_local, columns tangent,
/// bitangent, normal.
///
/// `normal`: unit length. The columns are orthonormal to 4e-7.
fn frame_from_normal(normal: vec3<f32>) -> mat3x3<f32> {
    // copysign(1, z): minus zero counts as negative; either sign is right.
    let side = select(1.0, -1.0, normal.z < 0.0);
    let a = -1.0 / (side + normal.z);
    let b = normal.x * normal.y * a;
    let tangent = vec3<f32>(1.0 + side * normal.x * normal.x * a, side * b, -side * normal.x);
    let bitangent = vec3<f32>(b, side + normal.y * normal.y * a, -normal.y);
    return mat3x3<f32>(tangent, bitangent, normal);
}
