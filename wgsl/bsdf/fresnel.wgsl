// SPDX-License-Identifier: MIT OR Apache-2.0
//! Fresnel reflectance.
#define_import_path lucerna::bsdf::fresnel

/// Schlick's approximation with reflectance 1 at grazing incidence: f0 + (1 − f0)(1 − cos)⁵.
///
/// C. Schlick, "An Inexpensive BRDF Model for Physically-Based Rendering", 1994, eq. 15. `f_zero`:
/// reflectance at normal incidence in [0, 1]. `cosine`: between direction and (micro)normal,
/// clamped to [0, 1].
fn schlick_fresnel(f_zero: vec3<f32>, cosine: f32) -> vec3<f32> {
    let m = clamp(1.0 - cosine, 0.0, 1.0);
    let square = m * m;
    return f_zero + (1.0 - f_zero) * (square * square * m);
}
