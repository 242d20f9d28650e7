// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF's metallic-roughness reflection.
//!
//! "glTF 2.0 Specification", Khronos 2021, appendix B.3:
//!
//! c_diff = mix(base, 0, metallic), f₀ = mix(0.04, base, metallic), α = roughness²,
//! F = f₀ + (1 − f₀)(1 − wo·h)⁵, f = (1 − F)·c_diff/π + F·D·V with D and V of [`ggx`].
//!
//! Reciprocal. Metals conserve energy (and lose some to microfacets that reflect only once).
//! Dielectrics may gain some: the two terms are weighted by the Fresnel factor of *their own* half
//! vector, so at grazing angles a smooth one reflects nearly all light specularly and 0.96·c_diff
//! of it once more. A white one reflects at most 1.001 up to 45°, 1.03 at 60°, 1.6 at 85° (roughness
//! below 0.2; 1.02 at 85° with roughness 0.8).
//!
//! Local frame: z is the shading normal; the caller flips it to wo's side. `wo`, `wi`: unit length,
//! away from the surface. Measure: solid angle.
#define_import_path lucerna::bsdf::metallic_roughness

#import lucerna::bsdf::bsdf_sample::BsdfSample
#import lucerna::bsdf::fresnel::schlick_fresnel
#import lucerna::bsdf::ggx::{ggx_distribution, ggx_visibility, sample_ggx_visible_normal, pdf_ggx_reflection}
#import lucerna::math::constants::INV_PI
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::hemisphere::{sample_cosine_hemisphere, pdf_cosine_hemisphere}

/// Reflectance of dielectrics at normal incidence (index of refraction 1.5).
const DIELECTRIC_REFLECTANCE: f32 = 0.04;
/// The sharpest lobe (perceptual roughness 0.032): the rounding of a half vector (6e-8) stays below
/// 1e-4 of its width. A perfect mirror is read as this.
const MIN_ALPHA: f32 = 1e-3;
/// Where both lobes are there, each is drawn at least this often: f·cos/pdf stays below 10 where
/// the estimate of their shares is off.
const MIN_LOBE_PROBABILITY: f32 = 0.1;

/// What the reflection depends on. From [`metallic_roughness`].
struct MetallicRoughness {
    /// Linear, in [0, 1].
    base_color: vec3<f32>,
    /// In [0, 1].
    metallic: f32,
    /// Width of the microfacet distribution, in [MIN_ALPHA, 1].
    alpha: f32,
}

/// `roughness`: perceptual. Values outside [0, 1] are clamped.
fn metallic_roughness(base_color: vec3<f32>, metallic: f32, roughness: f32) -> MetallicRoughness {
    let r = clamp(roughness, 0.0, 1.0);
    return MetallicRoughness(
        clamp(base_color, vec3<f32>(0.0), vec3<f32>(1.0)),
        clamp(metallic, 0.0, 1.0),
        max(r * r, MIN_ALPHA),
    );
}

/// Albedo of the diffuse term before Fresnel's share is taken.
fn diffuse_color(m: MetallicRoughness) -> vec3<f32> {
    return m.base_color * (1.0 - m.metallic);
}

/// Reflectance at normal incidence.
fn normal_reflectance(m: MetallicRoughness) -> vec3<f32> {
    return mix(vec3<f32>(DIELECTRIC_REFLECTANCE), m.base_color, m.metallic);
}

/// Unit vector halfway between two unit directions; the normal, +z, where they cancel.
fn half_vector(wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    // Directions that cancel are opposite and both grazing.
    return safe_normalize(wo + wi, vec3<f32>(0.0, 0.0, 1.0));
}

/// f(wo, wi) [sr⁻¹], without the cosine; 0 if either is not above the surface.
fn evaluate_metallic_roughness(m: MetallicRoughness, wo: vec3<f32>, wi: vec3<f32>) -> vec3<f32> {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return vec3<f32>(0.0);
    }
    let h = half_vector(wo, wi);
    let fresnel = schlick_fresnel(normal_reflectance(m), dot(wo, h));
    let specular = ggx_distribution(h, m.alpha) * ggx_visibility(wo.z, wi.z, m.alpha);
    return (1.0 - fresnel) * diffuse_color(m) * INV_PI + fresnel * specular;
}

/// How often the specular lobe is drawn: its share of the two lobes' estimated albedos, by the
/// Fresnel factor of the macroscopic normal.
fn specular_probability(m: MetallicRoughness, cos_o: f32) -> f32 {
    let fresnel = schlick_fresnel(normal_reflectance(m), cos_o);
    let mean = vec3<f32>(1.0 / 3.0);
    let specular = dot(fresnel, mean);
    let diffuse = dot((1.0 - fresnel) * diffuse_color(m), mean);
    if diffuse <= 0.0 {
        return 1.0;
    }
    return clamp(specular / (specular + diffuse), MIN_LOBE_PROBABILITY, 1.0 - MIN_LOBE_PROBABILITY);
}

/// Density with which [`sample_metallic_roughness`] draws `wi` [sr⁻¹]; 0 if either direction is not
/// above the surface. Integrates to 1 less what falls below the surface.
fn pdf_metallic_roughness(m: MetallicRoughness, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return 0.0;
    }
    let specular = pdf_ggx_reflection(wo.z, half_vector(wo, wi), m.alpha);
    return mix(pdf_cosine_hemisphere(wi.z), specular, specular_probability(m, wo.z));
}

/// Draws a direction: from the cosine or from the visible normals, as `u.z` says.
///
/// `u`: uniform in [0, 1)³. A pdf of 0 marks a mirrored direction that went below the surface, or a
/// `wo` that is not above it: nothing is reflected.
fn sample_metallic_roughness(m: MetallicRoughness, wo: vec3<f32>, u: vec3<f32>) -> BsdfSample {
    let failed = BsdfSample(vec3<f32>(0.0, 0.0, 1.0), vec3<f32>(0.0), 0.0);
    if !(wo.z > 0.0) {
        return failed;
    }
    var wi: vec3<f32>;
    if u.z < specular_probability(m, wo.z) {
        let h = sample_ggx_visible_normal(wo, m.alpha, u.xy);
        wi = normalize(2.0 * dot(wo, h) * h - wo);
    } else {
        wi = sample_cosine_hemisphere(u.xy);
    }
    let pdf = pdf_metallic_roughness(m, wo, wi);
    if !(pdf > 0.0) {
        return failed;
    }
    return BsdfSample(wi, evaluate_metallic_roughness(m, wo, wi) * (wi.z / pdf), pdf);
}
