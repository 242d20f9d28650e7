// SPDX-License-Identifier: MIT OR Apache-2.0
//! How much is open close by, in the picture's depths: what voxel cones skip, from the surface to where they begin.
//!
//! * `diffuse`: of the hemisphere, at a quarter of the pixels.
//! * `specular`: of the mirror's cone (screen-space specular occlusion).
//!
//! Dispatch: diffuse ceil(width/16) × ceil(height/16) × 1, specular ceil(width/8) × ceil(height/8) × 1.
//!
//! Workgroup memory: none. Each invocation owns a texel of `open`.

#import lucerna::bsdf::ggx::spread_of_ggx
#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::cone::cone_set::{drawn_cone_of_set, set_spread}
#import lucerna::integrators::depth_openness::depth_openness
#import lucerna::cone::march::{Cone, cells_across}
#import lucerna::fields::pyramid_layout::finest_cell
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::{pcg, pcg3d, unit_float}

const WORKGROUP: u32 = 8u;
/// Cones of the hemisphere.
const N_CONES: u32 = 5u;

struct OcclusionInfo {
    /// Where voxel cones begin over a surface across an axis [cells of the finest level there].
    start_cells: f32,
    /// tan of half the aperture of the mirror's cone; 0: from the roughness.
    specular_spread: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: OcclusionInfo;
/// r: share that is open, of the hemisphere weighted by the cosine.
@group(1) @binding(1) var open: texture_storage_2d<rgba8unorm, write>;

/// Where voxel cones begin over a surface point [m].
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
        let basis = frame_from_normal(surface.shading_normal);
        let hash = pcg3d(vec3<u32>(pixel, view.seed)).y;
        let jitter = unit_float(pcg(hash + view.frame));
        let normal = surface.geometric_normal;
        let reach = reach_at(surface.position, normal);
        sum = 0.0;
        var weights = 0.0;
        for (var ix = 0u; ix < N_CONES; ix++) {
            let member = drawn_cone_of_set(N_CONES, ix, sobol_owen(view.frame, pcg(hash + ix)));
            let direction = basis * member.direction;
            let rise = dot(direction, normal);
            if rise > 0.0 {
                let spread = set_spread(N_CONES);
                let cone = Cone(surface.position, spread, direction, reach / max(rise, 0.3), normal, 0.0);
                sum += member.weight * depth_openness(cone, jitter);
                weights += member.weight;
            }
        }
        // (What a bent normal leads below the surface is dark to the voxels' cones already.)
        sum = select(1.0, sum / weights, weights > 0.0);
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
        let direction = reflect(-surface.to_viewer, surface.shading_normal);
        let normal = surface.geometric_normal;
        let rise = dot(direction, normal);
        if rise > 0.0 {
            let alpha = surface.roughness * surface.roughness;
            let spread = select(info.specular_spread, spread_of_ggx(alpha), info.specular_spread == 0.0);
            let reach = reach_at(surface.position, normal) / max(rise, 0.3);
            let cone = Cone(surface.position, spread, direction, reach, normal, 0.0);
            let jitter = unit_float(pcg(pcg3d(vec3<u32>(id.xy, view.seed)).z + view.frame));
            found = depth_openness(cone, jitter);
        }
    }
    textureStore(open, id.xy, vec4<f32>(found, 0.0, 0.0, 0.0));
}
