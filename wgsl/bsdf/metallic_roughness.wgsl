// SPDX-License-Identifier: MIT OR Apache-2.0
//! glTF's metallic-roughness reflection, with a diffuse term that conserves energy.
//!
//! "glTF 2.0 Specification", Khronos 2021, appendix B; B. Burley, "Physically Based Shading at
//! Disney", SIGGRAPH course 2012:
//!
//! c_diff = mix(base, 0, metallic), f₀ = mix(0.04, base, metallic), α = roughness²,
//! F(x) = f₀ + (1 − f₀)(1 − x)⁵,
//! f = (1 − F(n·wo))·(1 − F(n·wi))·c_diff/π + F(wo·h)·D·V with D and V of [`ggx`].
//!
//! This is *not* the sample implementation of appendix B.3 (informative), which weights the diffuse term by 1 − F(wo·h)
//! once, and so differs for every surface that is not purely metallic. There, a smooth dielectric at grazing incidence
//! reflects nearly all light specularly and most of it once more: 1.85 times what arrives at 89°. B.3.6.3 names that
//! flaw, and the factors used here: the diffuse term does not get what the surface reflects on the way in or on the way
//! out. B.2 leaves the choice to implementations, and requires reciprocity and conservation of energy of exact ones.
//! (M. Ashikhmin, P. Shirley, "An Anisotropic Phong BRDF Model", 2000, couple the terms in the same way, with a flatter
//! curve than Schlick's, and normalise. Here that would be too much: divided by the mean of wi's factor, a white
//! dielectric of roughness 0.3 reflects 1.0013 at 54°.)
//!
//! Reciprocal, and (checked by quadrature) never reflects more than arrives, for any parameters and directions. Instead
//! it loses light: what the surface would reflect back inward is lost, so a white dielectric reflects 0.92 at normal
//! incidence, and rough ones darken towards the horizon (0.72 at 75°, 0.38 at 85° for roughness 1). Microfacets reflect
//! only once, so rough metals darken, too.
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
/// Mean of 1 − F over the hemisphere, by the cosine, for f₀ = 0: 1 − 2∫(1 − x)⁵·x dx.
const MEAN_TRANSMITTANCE: f32 = 20.0 / 21.0;
/// If both lobes exist, each is sampled at least this often: f·cos/pdf stays below 10 where the estimate of their
/// shares is wrong.
const MIN_LOBE_PROBABILITY: f32 = 0.1;

/// Parameters of the reflection, from [`metallic_roughness`].
struct MetallicRoughness {
    /// Linear, in [0, 1].
    base_color: vec3<f32>,
    /// In [0, 1].
    metallic: f32,
    /// Width of the microfacet distribution, in [MIN_ALPHA, 1].
    alpha: f32,
}

/// The reflection's parameters of a material. `roughness`: perceptual. Values outside [0, 1] are clamped.
fn metallic_roughness(base_color: vec3<f32>, metallic: f32, roughness: f32) -> MetallicRoughness {
    let r = clamp(roughness, 0.0, 1.0);
    return MetallicRoughness(
        clamp(base_color, vec3<f32>(0.0), vec3<f32>(1.0)),
        clamp(metallic, 0.0, 1.0),
        max(r * r, MIN_ALPHA),
    );
}

/// Albedo of the diffuse term, before the Fresnel factors.
fn diffuse_color(m: MetallicRoughness) -> vec3<f32> {
    return m.base_color * (1.0 - m.metallic);
}

/// Reflectance at normal incidence.
fn normal_reflectance(m: MetallicRoughness) -> vec3<f32> {
    return mix(vec3<f32>(DIELECTRIC_REFLECTANCE), m.base_color, m.metallic);
}

/// Unit vector halfway between two unit directions; the normal, +z, if they cancel.
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
    let f_zero = normal_reflectance(m);
    let transmitted = (1.0 - schlick_fresnel(f_zero, wo.z)) * (1.0 - schlick_fresnel(f_zero, wi.z));
    let specular = ggx_distribution(h, m.alpha) * ggx_visibility(wo.z, wi.z, m.alpha);
    return transmitted * diffuse_color(m) * INV_PI + schlick_fresnel(f_zero, dot(wo, h)) * specular;
}

/// Probability of sampling the specular lobe: its share of the two lobes' albedos. The specular albedo is estimated by
/// the Fresnel factor of the macroscopic normal; the diffuse one is exact.
fn specular_probability(m: MetallicRoughness, cos_o: f32) -> f32 {
    let f_zero = normal_reflectance(m);
    let fresnel = schlick_fresnel(f_zero, cos_o);
    let mean = vec3<f32>(1.0 / 3.0);
    let specular = dot(fresnel, mean);
    let transmitted = (1.0 - fresnel) * (1.0 - f_zero) * MEAN_TRANSMITTANCE;
    let diffuse = dot(transmitted * diffuse_color(m), mean);
    if diffuse <= 0.0 {
        return 1.0;
    }
    return clamp(specular / (specular + diffuse), MIN_LOBE_PROBABILITY, 1.0 - MIN_LOBE_PROBABILITY);
}

/// Density with which [`sample_metallic_roughness`] samples `wi` [sr⁻¹]; 0 if either direction is not above the
/// surface. Integrates to 1 minus the part below the surface.
fn pdf_metallic_roughness(m: MetallicRoughness, wo: vec3<f32>, wi: vec3<f32>) -> f32 {
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return 0.0;
    }
    let specular = pdf_ggx_reflection(wo.z, half_vector(wo, wi), m.alpha);
    return mix(pdf_cosine_hemisphere(wi.z), specular, specular_probability(m, wo.z));
}

/// Samples a direction: from the cosine or from the visible normals, chosen by `u.z`.
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

/// Samples a direction of the specular lobe only: `wo`, mirrored at a microfacet that it sees.
///
/// The weight is F·D·V·cos/pdf of that lobe, each component in [0, 1]; `u`: uniform in [0, 1)². A pdf of 0 marks a
/// mirrored direction that went below the surface, or a `wo` that is not above it: the weight is meaningless then.
fn sample_specular_lobe(m: MetallicRoughness, wo: vec3<f32>, u: vec2<f32>) -> BsdfSample {
    let h = sample_ggx_visible_normal(wo, m.alpha, u);
    let wi = reflect(-wo, h);
    if !(wo.z > 0.0 && wi.z > 0.0) {
        return BsdfSample(wi, vec3<f32>(0.0), 0.0);
    }
    let pdf = pdf_ggx_reflection(wo.z, h, m.alpha);
    let fresnel = schlick_fresnel(normal_reflectance(m), dot(wo, h));
    let weight = fresnel * ggx_distribution(h, m.alpha) * ggx_visibility(wo.z, wi.z, m.alpha) * wi.z / pdf;
    return BsdfSample(wi, weight, pdf);
}
