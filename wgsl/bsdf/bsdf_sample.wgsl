// SPDX-License-Identifier: MIT OR Apache-2.0
//! The result of sampling a BSDF.
#define_import_path lucerna::bsdf::bsdf_sample

/// A direction sampled from a BSDF.
struct BsdfSample {
    /// Unit length, in the local frame (z: shading normal), away from the surface.
    direction: vec3<f32>,
    /// f·cos/pdf, the factor of the radiance from `direction`.
    weight: vec3<f32>,
    /// Density in solid angle [sr⁻¹]; 0: there is no sample, and `weight` is 0.
    pdf: f32,
}
