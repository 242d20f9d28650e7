// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shadow maps: what is seen from a light, and how much of the light reaches a point.
//!
//! Depths are reversed: near/z for perspective views, 1 − (z − near)/range for parallel ones; 1 nearest, 0 farthest or
//! nothing. (Reversed, 32-bit floats are spaced evenly over distance: N. Reed, "Depth Precision Visualized", 2015.) The
//! pass that draws the map adds the slope's bias; a look-up moves its point along the surface's normal (D. Holbert,
//! "Saying 'Goodbye' to Shadow Acne", GDC 2011), so that no surface shades itself.
//!
//! Filters: PCF, percentage-closer filtering over a disc (W. Reeves, D. Salesin, R. Cook, SIGGRAPH 1987); PCSS,
//! percentage-closer soft shadows (R. Fernando, SIGGRAPH 2005): the disc is as wide as the penumbra of a light of
//! radius R whose blockers are at z_b: R·(1/z_b − 1/z_r) for a receiver at z_r, in units of a plane at distance 1.
//!
//! Symbols: z distance along the view's axis [m]; *plane*: x/z, y/z (for parallel views x, y [m]).
#define_import_path lucerna::components::shadow_maps::shadow_map

/// A picture from a light.
struct ShadowView {
    /// [m]
    position: vec3<f32>,
    /// Layer of the maps.
    layer: u32,
    /// Unit length.
    right: vec3<f32>,
    /// Half the picture's width in the plane: tan of half the field of view; for parallel views [m].
    half_width: f32,
    /// Unit length.
    up: vec3<f32>,
    /// Distance of the near plane [m].
    near: f32,
    /// Direction of view, unit length.
    forward: vec3<f32>,
    /// 0: perspective. Above 0: a parallel view of this depth [m].
    range: f32,
}

/// How maps are filtered.
struct ShadowFilter {
    /// Radius of the lights [m]; for parallel views tan of the light's angular radius. 0: PCF of `min_texels`.
    light_size: f32,
    /// The disc's least radius [texels].
    min_texels: f32,
    /// The disc's largest radius [texels].
    max_texels: f32,
    /// How far the point moves along the normal [texels].
    normal_offset: f32,
}

/// Lower bound of the cosine between a surface's normal and the light (3° above the surface).
const MIN_FACING: f32 = 0.05;
/// Points of the disc.
const N_TAPS: u32 = 32u;
/// The golden angle [rad]: H. Vogel, "A better way to construct the sunflower head", 1979.
const GOLDEN_ANGLE: f32 = 2.3999632;
/// Blockers are searched for within the radius from which a blocker at this share of the distance can reach the point
/// with its penumbra.
const NEAREST_BLOCKER: f32 = 0.25;

/// A point as a view sees it.
struct ShadowPoint {
    /// Coordinates in the plane.
    plane: vec2<f32>,
    /// [m]
    z: f32,
    /// Gradient of the reversed depth of the surface's own plane by the coordinates.
    gradient: vec2<f32>,
}

/// Where a view sees a point [m] of a surface with this normal (unit length, towards the light).
///
/// Reversed depth is linear over a plane: with the ray r = forward + x·right + y·up through (x, y), near/z is
/// near·(n·r)/(n·offset), and for parallel views z changes by −(n·right)/(n·forward). A wide filter that compared its
/// whole disc with the point's own depth would find that slanted surfaces shadow themselves.
fn shadow_point(view: ShadowView, position: vec3<f32>, normal: vec3<f32>) -> ShadowPoint {
    let offset = position - view.position;
    let z = dot(offset, view.forward);
    let across = vec2<f32>(dot(offset, view.right), dot(offset, view.up));
    let lean = vec2<f32>(dot(normal, view.right), dot(normal, view.up));
    if view.range > 0.0 {
        let facing = min(dot(normal, view.forward), -MIN_FACING);
        return ShadowPoint(across, z, lean / (facing * view.range));
    }
    let ray = offset / z;
    let facing = min(dot(normal, ray), -MIN_FACING * length(ray));
    return ShadowPoint(across / z, z, (view.near / z) * lean / facing);
}

/// Reversed depth at distance z [m].
fn shadow_depth(view: ShadowView, z: f32) -> f32 {
    return select(view.near / z, 1.0 - (z - view.near) / view.range, view.range > 0.0);
}

/// Inverse of [`shadow_depth`]; for perspective views `depth` must be above 0.
fn distance_of_depth(view: ShadowView, depth: f32) -> f32 {
    return select(view.near / depth, view.near + (1.0 - depth) * view.range, view.range > 0.0);
}

/// Clip-space position for the rasteriser.
fn shadow_clip(view: ShadowView, position: vec3<f32>) -> vec4<f32> {
    let offset = position - view.position;
    let z = dot(offset, view.forward);
    let across = vec2<f32>(dot(offset, view.right), dot(offset, view.up)) / view.half_width;
    if view.range > 0.0 {
        return vec4<f32>(across, shadow_depth(view, z), 1.0);
    }
    return vec4<f32>(across, view.near, z);
}

/// Width of a texel at the point's distance [m]. `size`: texels along each side of the map.
fn texel_width(view: ShadowView, z: f32, size: f32) -> f32 {
    return 2.0 * view.half_width / size * select(z, 1.0, view.range > 0.0);
}

/// Point `ix` of N_TAPS, spread evenly over the unit disc. `turn` [rad].
fn disc_tap(ix: u32, turn: f32) -> vec2<f32> {
    let radius = sqrt((f32(ix) + 0.5) / f32(N_TAPS));
    let angle = f32(ix) * GOLDEN_ANGLE + turn;
    return radius * vec2<f32>(cos(angle), sin(angle));
}

/// The map's coordinates of a point of the plane.
fn map_coordinates(view: ShadowView, plane: vec2<f32>) -> vec2<f32> {
    return vec2<f32>(0.5, -0.5) * (plane / view.half_width) + 0.5;
}

/// Share of the light that passes, over a disc of this radius in the plane.
///
/// `compare`: linear, `greater-equal` of the point's depth to the map's (reversed: what is nearer is larger).
fn filtered_visibility(
    maps: texture_depth_2d_array,
    compare: sampler_comparison,
    view: ShadowView,
    at: ShadowPoint,
    radius: f32,
    turn: f32,
) -> f32 {
    let depth = shadow_depth(view, at.z);
    var sum = 0.0;
    for (var ix = 0u; ix < N_TAPS; ix++) {
        let tap = radius * disc_tap(ix, turn);
        let uv = map_coordinates(view, at.plane + tap);
        let receiver = depth + dot(at.gradient, tap);
        sum += textureSampleCompareLevel(maps, compare, uv, view.layer, receiver);
    }
    return sum / f32(N_TAPS);
}

/// Mean distance of the blockers in front of the point, within a disc of the plane [m]; 0 if there are none.
fn blocker_distance(
    maps: texture_depth_2d_array,
    view: ShadowView,
    at: ShadowPoint,
    radius: f32,
    turn: f32,
) -> f32 {
    let size = vec2<i32>(textureDimensions(maps));
    let depth = shadow_depth(view, at.z);
    var sum = 0.0;
    var n = 0.0;
    for (var ix = 0u; ix < N_TAPS; ix++) {
        let tap = radius * disc_tap(ix, turn);
        let uv = map_coordinates(view, at.plane + tap);
        let texel = vec2<i32>(floor(uv * vec2<f32>(size)));
        if all(texel >= vec2<i32>(0)) && all(texel < size) {
            let found = textureLoad(maps, texel, view.layer, 0);
            if found > depth + dot(at.gradient, tap) {
                sum += distance_of_depth(view, found);
                n += 1.0;
            }
        }
    }
    return select(0.0, sum / n, n > 0.0);
}

/// Radius of the penumbra's disc in the plane.
fn penumbra_radius(view: ShadowView, light_size: f32, blocker: f32, receiver: f32) -> f32 {
    if view.range > 0.0 {
        return light_size * (receiver - blocker);
    }
    return light_size * (1.0 / blocker - 1.0 / receiver);
}

/// How much of the light a surface point gets, in [0, 1]; outside the map, all of it.
///
/// `position` [m], `normal`: geometric, unit length, towards the light; `turn` [rad]: rotation of the pattern, the same
/// or different for each point.
fn shadow_visibility(
    maps: texture_depth_2d_array,
    compare: sampler_comparison,
    view: ShadowView,
    filtering: ShadowFilter,
    position: vec3<f32>,
    normal: vec3<f32>,
    turn: f32,
) -> f32 {
    let size = f32(textureDimensions(maps).x);
    let z = dot(position - view.position, view.forward);
    if !(z > view.near) {
        return 1.0;
    }
    let moved = position + normal * (filtering.normal_offset * texel_width(view, z, size));
    let at = shadow_point(view, moved, normal);
    if any(abs(at.plane) > vec2<f32>(view.half_width)) || !(at.z > view.near) {
        return 1.0;
    }
    let texel = 2.0 * view.half_width / size;
    var radius = filtering.min_texels * texel;
    if filtering.light_size > 0.0 {
        let search = penumbra_radius(view, filtering.light_size, NEAREST_BLOCKER * at.z, at.z);
        let blocker =
            blocker_distance(maps, view, at, min(search, filtering.max_texels * texel), turn);
        if !(blocker > 0.0) {
            return 1.0;
        }
        let penumbra = penumbra_radius(view, filtering.light_size, blocker, at.z);
        radius = clamp(penumbra, radius, filtering.max_texels * texel);
    }
    return filtered_visibility(maps, compare, view, at, radius, turn);
}
