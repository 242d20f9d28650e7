// SPDX-License-Identifier: MIT OR Apache-2.0
//! Directions of an equirectangular sky, sampled by its brightness.
//!
//! M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., §A.5.6 and §12.5.2,
//! piecewise constant over the texels.
//!
//! `distribution`: r32float, (w + 1) × h texels for a sky of `size` (w, h). Texel (0, y) is the
//! marginal distribution through row y, that row included; texel (x + 1, y) is the conditional
//! distribution within row y through column x, that column included. Both rise to exactly 1. A
//! texel's weight is its luminance × sin θ of its row's centre, but any weights work. Mapping of
//! texels to directions: `lucerna::sky::equirectangular`.
#define_import_path lucerna::sky::environment

#import lucerna::sky::equirectangular::{direction_from_uv, uv_from_direction}
#import lucerna::math::constants::{ONE_BELOW, PI}

/// Lower bound of sin θ in densities, which are singular at the poles (in 3e-11 of the sphere).
const MIN_SINE: f32 = 1e-5;

/// A direction towards the sky.
struct EnvironmentSample {
    /// Position in the map.
    uv: vec2<f32>,
    /// Unit length, world space.
    direction: vec3<f32>,
    /// In solid angle [sr⁻¹]; 0 if the sky is black.
    pdf: f32,
}

/// The step of a distribution that a number in [0, 1) selects.
struct DistributionStep {
    /// Index of the step.
    ix: u32,
    /// Its probability.
    probability: f32,
    /// Position within it, in [0, 1).
    fraction: f32,
}

/// The distribution before and after step `ix`: row `y`'s conditional one, or the marginal.
fn step_bounds(distribution: texture_2d<f32>, marginal: bool, y: u32, ix: u32) -> vec2<f32> {
    var before = 0.0;
    if ix > 0u {
        let texel = select(vec2<u32>(ix, y), vec2<u32>(0u, ix - 1u), marginal);
        before = textureLoad(distribution, texel, 0).x;
    }
    let texel = select(vec2<u32>(ix + 1u, y), vec2<u32>(0u, ix), marginal);
    return vec2<f32>(before, textureLoad(distribution, texel, 0).x);
}

/// The first of `n_steps` steps whose distribution exceeds `u`.
fn find_step(
    distribution: texture_2d<f32>,
    marginal: bool,
    y: u32,
    n_steps: u32,
    u: f32,
) -> DistributionStep {
    var low = 0u;
    var high = n_steps - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        let texel = select(vec2<u32>(middle + 1u, y), vec2<u32>(0u, middle), marginal);
        if textureLoad(distribution, texel, 0).x > u {
            high = middle;
        } else {
            low = middle + 1u;
        }
    }
    let bounds = step_bounds(distribution, marginal, y, low);
    let probability = bounds.y - bounds.x;
    let fraction = select(0.0, (u - bounds.x) / probability, probability > 0.0);
    return DistributionStep(low, probability, clamp(fraction, 0.0, ONE_BELOW));
}

/// Texel probability → density in solid angle: a texel covers 2π²·sin θ/(w·h) at the polar angle θ.
fn environment_density(size: vec2<u32>, v: f32, probability: f32) -> f32 {
    let n_texels = f32(size.x) * f32(size.y);
    return probability * n_texels / (2.0 * PI * PI * max(sin(PI * v), MIN_SINE));
}

/// Samples a direction. `u`: uniform in [0, 1)².
fn sample_environment(
    distribution: texture_2d<f32>,
    size: vec2<u32>,
    u: vec2<f32>,
) -> EnvironmentSample {
    let row = find_step(distribution, true, 0u, size.y, u.y);
    let column = find_step(distribution, false, row.ix, size.x, u.x);
    let texel = vec2<f32>(vec2<u32>(column.ix, row.ix));
    let uv = (texel + vec2<f32>(column.fraction, row.fraction)) / vec2<f32>(size);
    let pdf = environment_density(size, uv.y, row.probability * column.probability);
    return EnvironmentSample(uv, direction_from_uv(uv), pdf);
}

/// Density with which [`sample_environment`] samples `direction` (not zero) [sr⁻¹].
fn pdf_environment(distribution: texture_2d<f32>, size: vec2<u32>, direction: vec3<f32>) -> f32 {
    let uv = uv_from_direction(direction);
    let texel = min(vec2<u32>(uv * vec2<f32>(size)), size - 1u);
    let row = step_bounds(distribution, true, 0u, texel.y);
    let column = step_bounds(distribution, false, texel.y, texel.x);
    return environment_density(size, uv.y, (row.y - row.x) * (column.y - column.x));
}
