// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: prefiltered voxels, read between their centres, from a buffer.
//!
//! Interface: `filtered_texel`, all that cones ask of storage besides `fields::pyramid_layout`. A texel is two words, four 16-bit floats; x fastest, then y, then z.
#define_import_path lucerna::fields::voxel_pyramid

#import lucerna::components::voxel_pyramid::layout::{VolumeSizes, index_of_texel, size_of_volume, texels_of_point, volume_of_mip}
#import lucerna::fields::pyramid_layout::pyramid

/// The three volumes, one after the other.
@group(3) @binding(17) var<storage, read> volume_texels: array<vec2<u32>>;

/// The texel of a face at a point, trilinear. `entry`: level · MAX_MIPS + mip; `point`: in cells of the mip.
fn filtered_texel(entry: u32, mip: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
    let place = texels_of_point(pyramid.mips[entry], face, point) - 0.5;
    let base = floor(place);
    let fraction = place - base;
    let volume = volume_of_mip(mip);
    let sizes = VolumeSizes(pyramid.volume_base, pyramid.volume_odd, pyramid.volume_even);
    let last = size_of_volume(sizes, volume) - 1u;
    var sum = vec4<f32>(0.0);
    for (var tap = 0u; tap < 8u; tap++) {
        let upper = (vec3<u32>(tap) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let shares = select(1.0 - fraction, fraction, upper != vec3<u32>(0u));
        let weight = shares.x * shares.y * shares.z;
        // The last texel of a border has weight 0 and may be outside.
        let at = min(vec3<u32>(base) + upper, last);
        let words = volume_texels[index_of_texel(sizes, volume, at)];
        sum += weight * vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
    }
    return sum;
}
