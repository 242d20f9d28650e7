// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much of uniform light from all directions a surface reflects to the viewer.
//!
//! Directional albedo ρ(wo) = ∫ f(wo, wi) cos(wi) dwi of lucerna::bsdf::metallic_roughness: reflected radiance =
//! ρ(wo)·E/π if the incoming radiance is constant over the hemisphere. Techniques that know only the irradiance use
//! this for the whole reflection.
//!
//! Diffuse term: exact, (1 − F(cos))·(1 − f₀)·20/21·c. Specular term: f₀·a + b, see `bsdf::split_sum`.
#define_import_path lucerna::bsdf::directional_albedo

#import lucerna::bsdf::fresnel::schlick_fresnel
#import lucerna::bsdf::split_sum::specular_albedo_terms
#import lucerna::bsdf::metallic_roughness::{MetallicRoughness, MEAN_TRANSMITTANCE, diffuse_color, normal_reflectance}

/// Share of uniform light that the diffuse term reflects, for a viewer at this cosine to the normal; each component in
/// [0, 1].
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

/// Share of uniform light that the specular term reflects, for a viewer at this cosine to the normal: ρ minus the
/// diffuse term's; each component in [0, 1].
fn specular_albedo(m: MetallicRoughness, cosine: f32) -> vec3<f32> {
    return max(directional_albedo(m, cosine) - diffuse_albedo(m, cosine), vec3<f32>(0.0));
}

/// The share of uniform light from the hemisphere that is reflected into all of it: ρ̄ = 2·∫ρ(μ)·μ dμ over the viewer's
/// cosine μ in [0, 1], by Gauss and Jacobi's three nodes for the weight μ. For surfaces that are seen from all
/// directions, such as voxels' faces.
fn hemispherical_albedo(m: MetallicRoughness) -> vec3<f32> {
    return 0.1396538 * directional_albedo(m, 0.2123405)
        + 0.4584822 * directional_albedo(m, 0.5905331)
        + 0.4018640 * directional_albedo(m, 0.9114120);
}
