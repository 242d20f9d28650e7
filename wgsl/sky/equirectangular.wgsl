// SPDX-License-Identifier: MIT OR Apache-2.0
//! Equirectangular maps of directions.
//!
//! World space, +Y up. v = 0 (top row) is +Y, v = 1 is −Y; u = 0 is −Z, 0.25 +X, 0.5 +Z, 0.75 −X.
//! Solid angle of du·dv: 2π²·sin(πv).
#define_import_path lucerna::sky::equirectangular

#import lucerna::math::constants::{PI, TWO_PI, INV_PI, INV_TWO_PI}

/// Position of a direction in the map: u in [0, 1), v in [0, 1]. For ±Y, u may be anything in its range, because
/// devices differ in atan2(0, 0).
///
/// `direction`: finite, not zero; its length does not matter.
fn uv_from_direction(direction: vec3<f32>) -> vec2<f32> {
    let turn = atan2(direction.x, -direction.z) * INV_TWO_PI;
    let u = select(turn, turn + 1.0, turn < 0.0);
    // From both legs, so that the angle is accurate at the poles, where acos is not.
    let v = atan2(length(direction.xz), direction.y) * INV_PI;
    // A tiny negative turn would round up to 1.
    return vec2<f32>(select(u, 0.0, u >= 1.0), clamp(v, 0.0, 1.0));
}

/// The unit vector of a point of the map; u repeats with period 1, v lies in [0, 1].
fn direction_from_uv(uv: vec2<f32>) -> vec3<f32> {
    let phi = TWO_PI * uv.x;
    let theta = PI * uv.y;
    let radius = sin(theta);
    return vec3<f32>(radius * sin(phi), cos(theta), -radius * cos(phi));
}

/// The colour of a map of `size` texels in a direction, bilinear between their centres; it repeats around the horizon and ends at the poles.
/// `direction`: as in [`uv_from_direction`].
fn equirectangular_color(map: texture_2d<f32>, size: vec2<u32>, direction: vec3<f32>) -> vec3<f32> {
    let n = vec2<i32>(size);
    let position = uv_from_direction(direction) * vec2<f32>(n) - 0.5;
    let base = floor(position);
    let weight = position - base;
    let y = clamp(vec2<i32>(i32(base.y), i32(base.y) + 1), vec2<i32>(0), vec2<i32>(n.y - 1));
    let x = (vec2<i32>(i32(base.x), i32(base.x) + 1) + n.x) % n.x;
    let upper = mix(
        textureLoad(map, vec2<i32>(x.x, y.x), 0).rgb,
        textureLoad(map, vec2<i32>(x.y, y.x), 0).rgb,
        weight.x,
    );
    let lower = mix(
        textureLoad(map, vec2<i32>(x.x, y.y), 0).rgb,
        textureLoad(map, vec2<i32>(x.y, y.y), 0).rgb,
        weight.x,
    );
    return mix(upper, lower, weight.y);
}
