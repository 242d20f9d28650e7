// SPDX-License-Identifier: MIT OR Apache-2.0
//! Indirect light of a picture's surfaces, looked up in the voxels.
//!
//! Dispatch: ceil(width/8) × ceil(height/8) × 1. Workgroup memory: none. Cost: one look-up per
//! pixel, independent of what was traced into the voxels.

#import lucerna::scene::pixel::{pixel_surface, view}
#import lucerna::fields::voxel_light::{cell_at, irradiance_at}
#import lucerna::frame::reflect::reflected_irradiance
#import lucerna::sampling::pcg::pcg3d

const WORKGROUP: u32 = 8u;

/// What is shown: reflected radiance; or, to inspect the voxels, irradiance, cells or levels.
const SHOWN_LIGHT: u32 = 0u;
const SHOWN_IRRADIANCE: u32 = 1u;
const SHOWN_CELLS: u32 = 2u;
const SHOWN_LEVELS: u32 = 3u;

struct ShadeInfo {
    /// A LOOKUP_ constant of `fields::voxel_light`.
    lookup: u32,
    /// A SHOWN_ constant.
    shown: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: ShadeInfo;
/// rgb: radiance [W·sr⁻¹·m⁻²], or what is shown instead.
@group(1) @binding(1) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if any(id.xy >= view.size) {
        return;
    }
    let surface = pixel_surface(id.xy);
    var radiance = vec3<f32>(0.0);
    if surface.is_surface && info.shown >= SHOWN_CELLS {
        radiance = color_of_cell(cell_at(surface.position, surface.geometric_normal), info.shown);
    } else if surface.is_surface {
        let irradiance = irradiance_at(surface.position, surface.shading_normal, info.lookup);
        radiance = select(reflected_irradiance(surface, irradiance), irradiance, info.shown == SHOWN_IRRADIANCE);
    }
    textureStore(indirect, id.xy, vec4<f32>(radiance, 1.0));
}

/// A colour that differs between neighbours, or the level's.
fn color_of_cell(cell: vec4<u32>, shown: u32) -> vec3<f32> {
    if shown == SHOWN_LEVELS {
        let bits = array<u32, 6>(1u, 2u, 4u, 3u, 5u, 6u)[min(cell.w, 5u)];
        return vec3<f32>((vec3<u32>(bits) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u));
    }
    return vec3<f32>(pcg3d(cell.xyz + 1024u * cell.w) >> vec3<u32>(8u)) / 16777216.0;
}
