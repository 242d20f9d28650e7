// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: shadow maps of point, spot and directional lights.
//!
//! Interface: `has_map`, `mapped_visibility`. (Its bindings start at 8, to leave room for another field's.)
#define_import_path lucerna::fields::shadow_maps

#import lucerna::sampling::pcg::{pcg3d, unit_float}
#import lucerna::components::shadow_maps::shadow_map::{ShadowFilter, ShadowView, shadow_visibility}

/// The most views: a spot or directional light has one, a point light six.
const MAX_VIEWS: u32 = 48u;
/// The most lights.
const MAX_LIGHTS: u32 = 16u;

struct ShadowMaps {
    views: array<ShadowView, MAX_VIEWS>,
    /// For each light x: its first view; y: the number of its views, 1 or 6 (+X −X +Y −Y +Z −Z); z: the bits of its
    /// `light_size`.
    lights: array<vec4<u32>, MAX_LIGHTS>,
    filtering: ShadowFilter,
    n_lights: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

@group(3) @binding(8) var<uniform> shadows: ShadowMaps;
@group(3) @binding(9) var shadow_textures: texture_depth_2d_array;
@group(3) @binding(10) var shadow_compare: sampler_comparison;

/// Whether there are maps for this light.
fn has_map(light_ix: u32) -> bool {
    return light_ix < shadows.n_lights;
}

/// How much of a light that has a map a surface point gets, in [0, 1].
fn mapped_visibility(light_ix: u32, position: vec3<f32>, normal: vec3<f32>) -> f32 {
    let light = shadows.lights[light_ix];
    var view = light.x;
    var filtering = shadows.filtering;
    if light.y == 6u {
        let offset = position - shadows.views[view].position;
        let size = abs(offset);
        var axis = select(1u, 0u, size.x >= size.y);
        axis = select(2u, axis, size[axis] >= size.z);
        view += 2u * axis + select(0u, 1u, offset[axis] < 0.0);
        // A disc that extends beyond the view would miss what the next view sees.
        let across = size / size[axis];
        let rest = shadows.views[view].half_width - max(across[(axis + 1u) % 3u], across[(axis + 2u) % 3u]);
        let texels = 0.5 * rest / shadows.views[view].half_width * f32(textureDimensions(shadow_textures).x);
        filtering.max_texels = min(filtering.max_texels, max(texels, filtering.min_texels));
    }
    filtering.light_size = bitcast<f32>(light.z);
    let hash = pcg3d(bitcast<vec3<u32>>(position)).x;
    let turn = 6.2831853 * unit_float(hash);
    return shadow_visibility(
        shadow_textures,
        shadow_compare,
        shadows.views[view],
        filtering,
        position,
        normal,
        turn,
    );
}
