// SPDX-License-Identifier: MIT OR Apache-2.0
//! The data of a pixel, summed over its samples or frames, from which all channels of a picture follow.
#define_import_path lucerna::frame::pixel_sums

/// Sums over a pixel's samples.
struct PixelSums {
    /// Radiance [W·sr⁻¹·m⁻²].
    emitted: vec3<f32>,
    /// Number of samples.
    n_samples: u32,
    direct: vec3<f32>,
    /// Number of samples that were rejected because they were not finite.
    n_rejected: u32,
    indirect: vec3<f32>,
    /// Distance along the view axis to the first surface [m].
    depth: f32,
    /// Base colour of the first surface.
    albedo: vec3<f32>,
    /// Number of samples that hit a surface.
    n_surfaces: u32,
    /// World-space shading normal of the first surface, towards the camera.
    normal: vec3<f32>,
    /// For the first surface, the cosine-weighted share of the hemisphere in which there is nothing within the
    /// occlusion distance; 1 if there is no surface.
    openness: f32,
}
