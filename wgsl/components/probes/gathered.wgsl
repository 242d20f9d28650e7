// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is gathered for a probe, before it is packed: spherical harmonics of order 2 in f32.
#define_import_path lucerna::components::probes::gathered

/// Coefficients of a probe. The gathered light is a `vec4<f32>` for each: rgb: coefficient of the radiance that arrives and was
/// reflected at least once [W·sr⁻¹·m⁻²].
const COEFFICIENTS: u32 = 9u;
