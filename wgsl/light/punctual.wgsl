// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lights without extent: point, spot, directional.
//!
//! glTF's extension KHR_lights_punctual, read radiometrically: candela as W·sr⁻¹, lux as W·m⁻².
//! E = I·window·cone·cosθ/d²; the functions leave out the receiver's cosine.
#define_import_path lucerna::light::punctual

#import lucerna::math::constants::FLOAT_MAX

/// The smallest difference of the cone's cosines that differs from a sharp edge (as in the extension).
const MIN_CONE_DIFFERENCE: f32 = 0.001;

/// What a light sends to a point.
struct PunctualSample {
    /// Unit length, from the point towards the light.
    to_light: vec3<f32>,
    /// [m]; FLOAT_MAX for directional lights.
    distance: f32,
    /// Irradiance on a surface that faces the light [W·m⁻²]; E is this times the cosine.
    normal_irradiance: vec3<f32>,
}

/// glTF's range window: 1 − (d/range)⁴, not below 0; 1 where `range` ≤ 0 (none is given).
fn range_window(distance: f32, range: f32) -> f32 {
    if range <= 0.0 {
        return 1.0;
    }
    let ratio = distance / range;
    let square = ratio * ratio;
    return clamp(1.0 - square * square, 0.0, 1.0);
}

/// Scale and offset of a spot's cone from the cosines of its inner and outer half angle
/// (0 ≤ inner < outer ≤ π/2).
fn spot_cone(cos_inner: f32, cos_outer: f32) -> vec2<f32> {
    let scale = 1.0 / max(MIN_CONE_DIFFERENCE, cos_inner - cos_outer);
    return vec2<f32>(scale, -cos_outer * scale);
}

/// A spot's share of its intensity in a direction: clamp(cos·scale + offset, 0, 1)². `cosine`: of
/// the angle to the spot's axis. `scale`, `offset`: from [`spot_cone`].
fn spot_attenuation(cosine: f32, scale: f32, offset: f32) -> f32 {
    let a = clamp(cosine * scale + offset, 0.0, 1.0);
    return a * a;
}

/// Light of a point light at `at`.
///
/// `intensity`: I [W·sr⁻¹]. `range` [m]: 0 for none. Distances in [1e-18, 1e18]; nearer, the result is 0; farther, the
/// light is too dim for f32.
fn sample_point_light(
    position: vec3<f32>,
    intensity: vec3<f32>,
    range: f32,
    at: vec3<f32>,
) -> PunctualSample {
    let offset = position - at;
    let square = dot(offset, offset);
    if !(square >= 1e-36 && square <= 1e36) {
        return PunctualSample(vec3<f32>(0.0, 1.0, 0.0), 0.0, vec3<f32>(0.0));
    }
    let distance = sqrt(square);
    let irradiance = intensity * (range_window(distance, range) / square);
    return PunctualSample(offset / distance, distance, irradiance);
}

/// Light of a spot at `at`.
///
/// `direction`: of the axis, in which light travels, unit length. `scale`, `offset`: from [`spot_cone`]. Otherwise as
/// [`sample_point_light`].
fn sample_spot_light(
    position: vec3<f32>,
    direction: vec3<f32>,
    intensity: vec3<f32>,
    range: f32,
    scale: f32,
    offset: f32,
    at: vec3<f32>,
) -> PunctualSample {
    var light = sample_point_light(position, intensity, range, at);
    light.normal_irradiance *= spot_attenuation(-dot(direction, light.to_light), scale, offset);
    return light;
}

/// Light from infinitely far away. `direction`: in which light travels, unit length. `irradiance`: on a surface that
/// faces it [W·m⁻²].
fn sample_directional_light(direction: vec3<f32>, irradiance: vec3<f32>) -> PunctualSample {
    return PunctualSample(-direction, FLOAT_MAX, irradiance);
}
