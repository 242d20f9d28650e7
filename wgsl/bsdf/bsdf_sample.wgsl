// SPDX-License-Identifier: MIT OR Apache-2.0
//! What sampling a BSDF returns.
#define_import_path lucerna::bsdf::bsdf_sample

/// A direction drawn from a BSDF.
struct BsdfSample {
    /// Unit length, in the local frame (z: shading normal), away from the surface.
    direction: vec3<f32>,
    /// f·cos/pdf: what the radiance from `direction` is multiplied by.
    weight: vec3<f32>,
    /// Density in solid angle [sr⁻¹]; 0: nothing was drawn, and `weight` is 0.
    pdf: f32,
}
