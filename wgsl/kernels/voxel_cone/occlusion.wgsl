// SPDX-License-Identifier: MIT OR Apache-2.0
//! Screen-space openness close by, from the picture's depths: the part that voxel cones skip, from the surface to where
//! they start.
//!
//! * `diffuse`: for the hemisphere, at a quarter of the pixels.
//! * `specular`: for the specular cone (screen-space specular occlusion).
//!
//! Dispatch: diffuse ceil(width/16) × ceil(height/16) × 1, specular ceil(width/8) × ceil(height/8) × 1.
//!
//! Workgroup memory: none. Each invocation owns a texel of `open`.

#import lucerna::bsdf::ggx::spread_of_ggx
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::integrators::depth_openness::{direction_openness, hemisphere_openness}
#import lucerna::cone::march::cells_across
#import lucerna::fields::pyramid_layout::finest_cell
#import lucerna::sampling::pcg::{pcg, pcg3d, unit_float}

const WORKGROUP: u32 = 8u;

struct OcclusionInfo {
    /// Height at which voxel cones start above a surface across an axis [cells of the finest level there].
    start_cells: f32,
    /// tan of half the aperture of the specular cone; 0: it follows from the roughness.
    specular_spread: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: OcclusionInfo;
/// r: share that is open; for the hemisphere, weighted by the cosine.
@group(1) @binding(1) var open: texture_storage_2d<rgba8unorm, write>;

/// Height at which voxel cones start above a surface point [m].
fn reach_at(position: vec3<f32>, normal: vec3<f32>) -> f32 {
    return info.start_cells * finest_cell(position) * cells_across(normal);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn diffuse(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = min(2u * id.xy, view.size - 1u);
    if any(2u * id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(pixel);
    var sum = 1.0;
    if surface.is_surface {
        let hash = pcg3d(vec3<u32>(pixel, view.seed)).y;
        sum = hemisphere_openness(
            surface.position,
            surface.geometric_normal,
            surface.shading_normal,
            reach_at(surface.position, surface.geometric_normal),
            hash,
            view.frame,
            unit_float(pcg(hash + view.frame)),
        );
    }
    textureStore(open, id.xy, vec4<f32>(sum, 0.0, 0.0, 0.0));
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn specular(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var found = 1.0;
    if surface.is_surface && !surface.lambert {
        let alpha = surface.roughness * surface.roughness;
        found = direction_openness(
            surface.position,
            surface.geometric_normal,
            reflect(-surface.to_viewer, surface.shading_normal),
            select(info.specular_spread, spread_of_ggx(alpha), info.specular_spread == 0.0),
            reach_at(surface.position, surface.geometric_normal),
            unit_float(pcg(pcg3d(vec3<u32>(id.xy, view.seed)).z + view.frame)),
        );
    }
    textureStore(open, id.xy, vec4<f32>(found, 0.0, 0.0, 0.0));
}
