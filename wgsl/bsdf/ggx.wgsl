// SPDX-License-Identifier: MIT OR Apache-2.0
//! The isotropic GGX (Trowbridge–Reitz) microfacet distribution with Smith's height-correlated
//! masking and shadowing.
//!
//! B. Walter et al., "Microfacet Models for Refraction through Rough Surfaces", EGSR 2007 (D);
//! E. Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", JCGT 3(2),
//! 2014 (G); J. Dupuy, A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", HPG 2023.
//!
//! Local frame: z is the macroscopic normal. `alpha`: width of the distribution (glTF: roughness²),
//! in [1e-3, 1]. `wo`, `wi`: unit length, away from the surface, z > 0. h: the unit half vector.
#define_import_path lucerna::bsdf::ggx

#import lucerna::math::constants::{INV_PI, TWO_PI}
#import lucerna::math::vector::safe_normalize

/// Lower bound of the visibility's divisor, so that it stays finite at exactly grazing angles.
const MIN_VISIBILITY_DIVISOR: f32 = 1e-20;

/// D(h) [sr⁻¹]: ∫ D(h) h.z dh = 1 over the hemisphere.
///
/// Written with the tangent components, which keep their relative accuracy where 1 − h.z² has none.
fn ggx_distribution(h: vec3<f32>, alpha: f32) -> f32 {
    let square = alpha * alpha;
    let stretched = dot(h.xy, h.xy) / square + h.z * h.z;
    return INV_PI / (square * stretched * stretched);
}

/// √(α² + (1 − α²)·cos²): the root in Smith's Λ, multiplied by the cosine.
fn smith_root(cosine: f32, alpha: f32) -> f32 {
    let square = alpha * alpha;
    return sqrt(square + (1.0 - square) * cosine * cosine);
}

/// V = G₂/(4·cos_o·cos_i), height-correlated (Heitz 2014, eq. 99). Cosines in (0, 1].
fn ggx_visibility(cos_o: f32, cos_i: f32, alpha: f32) -> f32 {
    let divisor = cos_i * smith_root(cos_o, alpha) + cos_o * smith_root(cos_i, alpha);
    return 0.5 / max(divisor, MIN_VISIBILITY_DIVISOR);
}

/// A microfacet normal h, distributed as those visible from `wo`:
/// G₁(wo)·max(0, wo·h)·D(h)/wo.z [sr⁻¹]. `u` is uniform in [0, 1)².
fn sample_ggx_visible_normal(wo: vec3<f32>, alpha: f32, u: vec2<f32>) -> vec3<f32> {
    // Stretched by α, the distribution is a hemisphere, and the reflections of `from` off it fill a spherical cap
    // uniformly.
    let stretched = normalize(vec3<f32>(wo.xy * alpha, wo.z));
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let radius = sqrt(clamp(1.0 - z * z, 0.0, 1.0));
    let phi = TWO_PI * u.x;
    let normal = vec3<f32>(radius * cos(phi), radius * sin(phi), z) + stretched;
    return normalize(vec3<f32>(normal.xy * alpha, max(normal.z, 0.0)));
}

/// Density of the direction that `wo` is mirrored to about a normal of
/// [`sample_ggx_visible_normal`]: G₁(wo)·D(h)/(4·wo.z) [sr⁻¹ of wi].
///
/// The whole density integrates to 1 over the sphere; the part below the surface is lost.
fn pdf_ggx_reflection(cos_o: f32, h: vec3<f32>, alpha: f32) -> f32 {
    return ggx_distribution(h, alpha) / (2.0 * (cos_o + smith_root(cos_o, alpha)));
}

/// tan of half the aperture of the cone that approximates a GGX lobe of width α (perceptual roughness squared): half of
/// the microfacets are tilted by less than atan α (F(θ) = tan²θ/(α² + tan²θ); B. Walter et al., "Microfacet Models for
/// Refraction", 2007, eq. 35), and a mirrored direction turns twice as far. At most 60°.
fn spread_of_ggx(alpha: f32) -> f32 {
    return tan(min(2.0 * atan(alpha), 1.0471976));
}

/// Sharpness κ of the lobe exp(κ(ω·d − 1)) around [`mean_of_ggx`] that, above the surface, is as wide as what a GGX lobe of width α reflects: our
/// fit to its mean cosine, within 0.05 for α from 0.05 on. (Half of 1/α², as for the microfacets' normals, is too sharp: GGX has long tails.)
fn sharpness_of_ggx(alpha: f32) -> f32 {
    return 1.4 / alpha;
}

/// The mean direction from which a GGX lobe of width α takes uniform light, unit length: between the mirrored direction and the normal. Our fit, within
/// 0.08 rad of the integral for α from 0.05 and a cosine of the viewer to the normal from 0.2 on. `normal`, `to_viewer`: unit length.
fn mean_of_ggx(normal: vec3<f32>, to_viewer: vec3<f32>, alpha: f32) -> vec3<f32> {
    let smoothness = clamp(1.0 - alpha, 1e-4, 1.0);
    let slant = 1.0 - clamp(dot(normal, to_viewer), 0.0, 1.0);
    let power = 1.25 - 1.3 * smoothness + (2.1 * smoothness - 0.15) * slant;
    let share = min(pow(smoothness, power), 1.0);
    return safe_normalize(mix(normal, reflect(-to_viewer, normal), share), normal);
}
