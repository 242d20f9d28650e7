// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is known of a pixel, summed over its samples or frames: all channels of a picture follow from it.
#define_import_path lucerna::frame::pixel_sums

/// Sums over a pixel's samples.
struct PixelSums {
    /// Radiance [W·sr⁻¹·m⁻²].
    emitted: vec3<f32>,
    /// How many samples were added.
    n_samples: u32,
    direct: vec3<f32>,
    /// How many samples were rejected because they were not finite.
    n_rejected: u32,
    indirect: vec3<f32>,
    /// Distance along the view axis to the first surface [m].
    depth: f32,
    /// Base colour of the first surface.
    albedo: vec3<f32>,
    /// How many samples met a surface.
    n_surfaces: u32,
    /// World-space shading normal of the first surface, towards the camera.
    normal: vec3<f32>,
    /// Of the first surface: cosine-weighted share of the hemisphere in which nothing stands within the
    /// occlusion distance; 1 where there is no surface.
    openness: f32,
}
