// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much of uniform light from all directions a GGX lobe reflects, as scale and bias on the reflectance f₀ at normal
//! incidence.
//!
//! The split of B. Karis, "Real Shading in Unreal Engine 4", SIGGRAPH course 2013, for the height-correlated visibility
//! of `bsdf::ggx`. (His polynomial fits for a and b belong to another shadowing term: for a rough metal at grazing
//! incidence they give 0.7, but it reflects 0.38.)
#define_import_path lucerna::bsdf::split_sum

/// The fit holds from here on; smaller values are clamped to this.
const MIN_FIT_ROUGHNESS: f32 = 0.15;
const MIN_FIT_COSINE: f32 = 0.05;

/// Scale and bias on f₀ of the specular term's directional albedo: a = ∫(1 − (1 − wo·h)⁵)·D·V·cos and
/// b = ∫(1 − wo·h)⁵·D·V·cos, each as a polynomial of degree 4 in both arguments, fitted to the
/// integrals by quadrature over the visible normals with the largest error kept down.
///
/// `roughness`: perceptual, in [0, 1]. `cosine`: of the viewer to the normal, in [0, 1]. Within 0.03
/// of the integrals from roughness 0.15 and cosine 0.05 on.
fn specular_albedo_terms(roughness: f32, cosine: f32) -> vec2<f32> {
    let r = max(roughness, MIN_FIT_ROUGHNESS);
    let c = max(cosine, MIN_FIT_COSINE);
    // Coefficients of r⁰ to r⁴, each a polynomial in c; x for a, y for b.
    let zero = vec2<f32>(-0.0269, 1.1047) + c * (vec2<f32>(4.3407, -3.8490)
        + c * (vec2<f32>(-4.1566, 3.1623) + c * (vec2<f32>(-0.2704, 0.6113) + c * vec2<f32>(1.0412, -1.0617))));
    let one = vec2<f32>(0.8855, -2.4266) + c * (vec2<f32>(-10.3283, 9.5612)
        + c * (vec2<f32>(12.8971, -8.5601) + c * vec2<f32>(-3.3256, 1.9459)));
    let two = vec2<f32>(4.0819, 0.4526) + c * (vec2<f32>(2.3351, -6.0771) + c * vec2<f32>(-4.5918, 3.5258));
    let three = vec2<f32>(-6.8795, 2.0729) + c * vec2<f32>(1.4113, 0.7545);
    let four = vec2<f32>(2.8649, -1.1969);
    return zero + r * (one + r * (two + r * (three + r * four)));
}
