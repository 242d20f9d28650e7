// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much of the light that arrives alike from everywhere a surface reflects to the viewer.
//!
//! Directional albedo ρ(wo) = ∫ f(wo, wi) cos(wi) dwi of lucerna::bsdf::metallic_roughness: reflected
//! radiance = ρ(wo)·E/π where the incoming radiance is constant over the hemisphere. Techniques that
//! know the irradiance alone take this for all of the reflection.
//!
//! Diffuse term: exact, (1 − F(cos))·(1 − f₀)·20/21·c. Specular term: f₀·a + b with a and b as
//! B. Karis, "Physically Based Shading on Mobile", 2014, fits them (after D. Lazarov, 2013).
#define_import_path lucerna::bsdf::directional_albedo

#import lucerna::bsdf::fresnel::schlick_fresnel
#import lucerna::bsdf::metallic_roughness::{MetallicRoughness, MEAN_TRANSMITTANCE, diffuse_color, normal_reflectance}

/// Scale and bias on f₀ of the specular term's directional albedo.
///
/// `roughness`: perceptual, in [0, 1]. `cosine`: of the viewer to the normal, in [0, 1]. Within 0.04
/// of the integral for roughness ≥ 0.2.
fn specular_albedo_terms(roughness: f32, cosine: f32) -> vec2<f32> {
    let r = roughness * vec4<f32>(-1.0, -0.0275, -0.572, 0.022) + vec4<f32>(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * cosine)) * r.x + r.y;
    return vec2<f32>(-1.04, 1.04) * a + r.zw;
}

/// ρ for a viewer at this cosine to the normal; each component in [0, 1].
fn directional_albedo(m: MetallicRoughness, cosine: f32) -> vec3<f32> {
    let f_zero = normal_reflectance(m);
    let cos_o = clamp(cosine, 0.0, 1.0);
    let transmitted = (1.0 - schlick_fresnel(f_zero, cos_o)) * (1.0 - f_zero) * MEAN_TRANSMITTANCE;
    let terms = specular_albedo_terms(sqrt(m.alpha), cos_o);
    let specular = f_zero * terms.x + terms.y;
    return clamp(transmitted * diffuse_color(m) + specular, vec3<f32>(0.0), vec3<f32>(1.0));
}
