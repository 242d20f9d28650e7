// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much of the light that arrives alike from everywhere a surface reflects to the viewer.
//!
//! Directional albedo ρ(wo) = ∫ f(wo, wi) cos(wi) dwi of lucerna::bsdf::metallic_roughness: reflected
//! radiance = ρ(wo)·E/π where the incoming radiance is constant over the hemisphere. Techniques that
//! know the irradiance alone take this for all of the reflection.
//!
//! Diffuse term: exact, (1 − F(cos))·(1 − f₀)·20/21·c. Specular term: f₀·a + b, the split of B. Karis,
//! "Real Shading in Unreal Engine 4", SIGGRAPH course 2013. (His polynomial fits for a and b belong to
//! another shadowing term: of a rough metal at grazing incidence they give 0.7, and it reflects 0.38.)
#define_import_path lucerna::bsdf::directional_albedo

#import lucerna::bsdf::fresnel::schlick_fresnel
#import lucerna::bsdf::metallic_roughness::{MetallicRoughness, MEAN_TRANSMITTANCE, diffuse_color, normal_reflectance}

/// The fit holds from here on; smoother surfaces and lower viewers are read as this.
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

/// What the diffuse term reflects of even light, for a viewer at this cosine to the normal; each component in [0, 1].
fn diffuse_albedo(m: MetallicRoughness, cosine: f32) -> vec3<f32> {
    let f_zero = normal_reflectance(m);
    let cos_o = clamp(cosine, 0.0, 1.0);
    return (1.0 - schlick_fresnel(f_zero, cos_o)) * (1.0 - f_zero) * MEAN_TRANSMITTANCE * diffuse_color(m);
}

/// ρ for a viewer at this cosine to the normal; each component in [0, 1].
fn directional_albedo(m: MetallicRoughness, cosine: f32) -> vec3<f32> {
    let terms = specular_albedo_terms(sqrt(m.alpha), clamp(cosine, 0.0, 1.0));
    let specular = normal_reflectance(m) * terms.x + terms.y;
    return clamp(diffuse_albedo(m, cosine) + specular, vec3<f32>(0.0), vec3<f32>(1.0));
}

/// What the specular term reflects of even light, for a viewer at this cosine to the normal: ρ less the diffuse term's; each component
/// in [0, 1].
fn specular_albedo(m: MetallicRoughness, cosine: f32) -> vec3<f32> {
    return max(directional_albedo(m, cosine) - diffuse_albedo(m, cosine), vec3<f32>(0.0));
}

/// The share of even light from the hemisphere that leaves into all of it: ρ̄ = 2·∫ρ(μ)·μ dμ over the viewer's cosine μ in [0, 1], by
/// Gauss and Jacobi's three nodes for the weight μ. What surfaces reflect that are seen from everywhere, voxels' faces.
fn hemispherical_albedo(m: MetallicRoughness) -> vec3<f32> {
    return 0.1396538 * directional_albedo(m, 0.2123405)
        + 0.4584822 * directional_albedo(m, 0.5905331)
        + 0.4018640 * directional_albedo(m, 0.9114120);
}
