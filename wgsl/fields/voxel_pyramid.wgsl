// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: prefiltered voxels, read between their centres.
//!
//! Interface: `filtered_texel`, all that cones ask of storage besides `fields::pyramid_layout`. This one filters in
//! textures; the variant `volumes=buffers` computes the same numbers from buffers.
#define_import_path lucerna::fields::voxel_pyramid

#import lucerna::components::voxel_pyramid::layout::{texels_of_point, volume_of_mip}
#import lucerna::fields::pyramid_layout::pyramid

@group(3) @binding(17) var volume_base: texture_3d<f32>;
@group(3) @binding(18) var volume_odd: texture_3d<f32>;
@group(3) @binding(19) var volume_even: texture_3d<f32>;
@group(3) @binding(20) var filtering: sampler;

/// The texel of a face at a point, trilinear. `entry`: level · MAX_MIPS + mip; `point`: in cells of the mip.
fn filtered_texel(entry: u32, mip: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
    let place = texels_of_point(pyramid.mips[entry], face, point);
    let volume = volume_of_mip(mip);
    if volume == 0u {
        return textureSampleLevel(volume_base, filtering, place / vec3<f32>(pyramid.volume_base), 0.0);
    }
    if volume == 1u {
        return textureSampleLevel(volume_odd, filtering, place / vec3<f32>(pyramid.volume_odd), 0.0);
    }
    return textureSampleLevel(volume_even, filtering, place / vec3<f32>(pyramid.volume_even), 0.0);
}
