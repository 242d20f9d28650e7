// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of a probe, unpacked: spherical harmonics of order 4 without band 3.
//!
//! Interface: `ProbeLight`, `light_irradiance`.
#define_import_path lucerna::components::probes::probe_light

#import lucerna::components::probes::bands::KEPT_COEFFICIENTS
#import lucerna::sh::basis::sh_band_four
#import lucerna::sh::convolve::{sh2_irradiance, sh_cosine_factor}

/// The light of a probe.
struct ProbeLight {
    /// Coefficients of radiance [W·sr⁻¹·m⁻²]: nine of the bands 0 to 2, nine of band 4.
    coefficients: array<vec3<f32>, KEPT_COEFFICIENTS>,
}

/// Irradiance on a surface with unit normal [W·m⁻²]; may be below 0 where the light rings.
fn light_irradiance(light: ProbeLight, normal: vec3<f32>) -> vec3<f32> {
    var c = light.coefficients;
    let low = sh2_irradiance(array<vec3<f32>, 9>(c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]), normal);
    var y = sh_band_four(normal);
    var high = vec3<f32>(0.0);
    for (var k = 0u; k < 9u; k++) {
        high += c[9u + k] * y[k];
    }
    return low + sh_cosine_factor(4u) * high;
}
