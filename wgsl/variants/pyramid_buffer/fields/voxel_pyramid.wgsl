// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: prefiltered voxels, read between their centres, from buffers alone.
//!
//! Interface: `pyramid`, `filtered_texel`. A texel is two words, four 16-bit floats; x fastest, then y, then z.
#define_import_path lucerna::fields::voxel_pyramid

#import lucerna::cone::pyramid::{PyramidLayout, texels_of_point, volume_of_mip}

@group(2) @binding(0) var<uniform> pyramid: PyramidLayout;
@group(2) @binding(1) var<storage, read> volume_base: array<vec2<u32>>;
@group(2) @binding(2) var<storage, read> volume_odd: array<vec2<u32>>;
@group(2) @binding(3) var<storage, read> volume_even: array<vec2<u32>>;

/// The texel of a face at a point, trilinear. `entry`: level · MAX_MIPS + mip; `point`: in cells of the mip.
fn filtered_texel(entry: u32, mip: u32, face: u32, point: vec3<f32>) -> vec4<f32> {
    let place = texels_of_point(pyramid.mips[entry], face, point) - 0.5;
    let base = floor(place);
    let fraction = place - base;
    let volume = volume_of_mip(mip);
    var size = pyramid.volume_base;
    if volume == 1u {
        size = pyramid.volume_odd;
    } else if volume == 2u {
        size = pyramid.volume_even;
    }
    var sum = vec4<f32>(0.0);
    for (var tap = 0u; tap < 8u; tap++) {
        let upper = (vec3<u32>(tap) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u);
        let shares = select(1.0 - fraction, fraction, upper != vec3<u32>(0u));
        let weight = shares.x * shares.y * shares.z;
        // The last texel of a border has weight 0 and may lie outside.
        let at = min(vec3<u32>(base) + upper, size - 1u);
        let ix = (at.z * size.y + at.y) * size.x + at.x;
        var words: vec2<u32>;
        if volume == 0u {
            words = volume_base[ix];
        } else if volume == 1u {
            words = volume_odd[ix];
        } else {
            words = volume_even[ix];
        }
        sum += weight * vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
    }
    return sum;
}
