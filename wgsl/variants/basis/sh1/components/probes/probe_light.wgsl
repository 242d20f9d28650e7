// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of a probe, unpacked: spherical harmonics of order 1.
//!
//! Interface: `ProbeLight`, `light_irradiance`. Which form it has is chosen by the variant `basis`.
#define_import_path lucerna::components::probes::probe_light

#import lucerna::sh::convolve::sh1_irradiance

/// The light of a probe.
struct ProbeLight {
    /// Coefficients of radiance [W·sr⁻¹·m⁻²].
    coefficients: array<vec3<f32>, 4>,
}

/// Irradiance on a surface with unit normal [W·m⁻²]; may be below 0 where the light rings.
fn light_irradiance(light: ProbeLight, normal: vec3<f32>) -> vec3<f32> {
    return sh1_irradiance(light.coefficients, normal);
}
