// SPDX-License-Identifier: MIT OR Apache-2.0
//! Weights of neighbouring pixels by the similarity of their surfaces, for edge-preserving filters and upscaling.
//!
//! J. Kopf, M. Cohen, D. Lischinski, M. Uyttendaele, "Joint Bilateral Upsampling", SIGGRAPH 2007.
#define_import_path lucerna::frame::upscale

/// Distance off the plane, as a share of the depth, at which a neighbour's weight is e⁻¹.
const PLANE_SCALE: f32 = 0.01;
/// Power of the cosine between normals.
const NORMAL_POWER: f32 = 16.0;

/// Weight of a neighbour, in [0, 1]: 1 on the same plane, falling with its distance off the plane and with the angle
/// between the normals.
///
/// `offset`: from the surface point to the neighbour's [m]; `depth`: of the point [m]; normals: unit length.
fn surface_weight(offset: vec3<f32>, depth: f32, normal: vec3<f32>, other_normal: vec3<f32>) -> f32 {
    let off_plane = abs(dot(offset, normal)) / (PLANE_SCALE * depth);
    let alike = pow(max(dot(normal, other_normal), 0.0), NORMAL_POWER);
    return exp(-off_plane) * alike;
}

/// Gaussian weight of a pixel `offset` away, of standard deviation `sigma` [pixels].
fn gaussian_weight(offset: vec2<f32>, sigma: f32) -> f32 {
    return exp(-0.5 * dot(offset, offset) / (sigma * sigma));
}

/// Bilinear weight of the texel `corner` (0 or 1 per axis) of four, for a point at `share` between them, in [0, 1]²;
/// the four sum to 1.
fn bilinear_weight(corner: vec2<u32>, share: vec2<f32>) -> f32 {
    let weights = select(1.0 - share, share, corner != vec2<u32>(0u));
    return weights.x * weights.y;
}
