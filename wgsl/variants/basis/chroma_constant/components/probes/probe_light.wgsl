// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of a probe, unpacked: luma of order 2, and the means of two differences
//! of colour.
//!
//! Interface: `ProbeLight`, `light_irradiance`. Which form it has is chosen by the variant `basis`.
#define_import_path lucerna::components::probes::probe_light

#import lucerna::sh::basis::sh2_basis
#import lucerna::sh::convolve::sh_cosine_factor

/// Numbers of a probe: 9 of luma, 1 of each difference.
const NUMBERS: u32 = 11u;
/// Coefficients of each difference of colour.
const CHROMA: u32 = 1u;

/// The light of a probe.
struct ProbeLight {
    /// Luma, then Co, then Cg: coefficients of radiance [W·sr⁻¹·m⁻²].
    numbers: array<f32, NUMBERS>,
}

/// Irradiance on a surface with unit normal [W·m⁻²]; may be below 0 where the light rings.
fn light_irradiance(light: ProbeLight, normal: vec3<f32>) -> vec3<f32> {
    var numbers = light.numbers;
    var y = sh2_basis(normal);
    var luma = 0.0;
    for (var k = 0u; k < 9u; k++) {
        let band = select(select(2u, 1u, k < 4u), 0u, k == 0u);
        y[k] *= sh_cosine_factor(band);
        luma += y[k] * numbers[k];
    }
    var orange = 0.0;
    var green = 0.0;
    for (var k = 0u; k < CHROMA; k++) {
        orange += y[k] * numbers[9u + k];
        green += y[k] * numbers[9u + CHROMA + k];
    }
    return vec3<f32>(luma + orange - green, luma + green, luma - orange - green);
}
