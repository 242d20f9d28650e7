// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much a probe counts for a surface point that it may not see.
//!
//! Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019, with the
//! variance shadow test of W. Donnelly, A. Lauritzen, "Variance Shadow Maps", I3D 2006, and the reduction of light bleeding of A.
//! Lauritzen, "Summed-Area Variance Shadow Maps", GPU Gems 3, chapter 8, 2007. Units: any of length, the same for all.
#define_import_path lucerna::components::probes::visibility

/// In [0, 1]: how likely it is that nothing is between a probe and a point at this distance. `moments`: mean distance to the
/// surfaces in that direction, and mean of its square.
///
/// One-sided Chebyshev inequality: of distances with mean m and variance v, at most v/(v + (d − m)²) are above d > m.
/// `least_variance` > 0 keeps surfaces that the map knows exactly from hiding themselves.
fn seen_share(distance: f32, moments: vec2<f32>, least_variance: f32) -> f32 {
    let beyond = distance - moments.x;
    if beyond <= 0.0 {
        return 1.0;
    }
    let variance = max(moments.y - moments.x * moments.x, least_variance);
    return variance / (variance + beyond * beyond);
}

/// In [0.2, 1.2]: probes in front of the surface count more than those behind it, without an edge between them. `normal`, `to_probe`:
/// unit length.
fn wrapped_weight(normal: vec3<f32>, to_probe: vec3<f32>) -> f32 {
    let half_cosine = 0.5 * dot(normal, to_probe) + 0.5;
    return half_cosine * half_cosine + 0.2;
}

/// A share in [0, 1] of which what is below `bleeding` (0 to below 1) becomes 0, and the rest is stretched: where near and far surfaces
/// lie in one direction, the bound of `seen_share` is far from what is seen.
fn without_bleeding(share: f32, bleeding: f32) -> f32 {
    return max(share - bleeding, 0.0) / (1.0 - bleeding);
}
