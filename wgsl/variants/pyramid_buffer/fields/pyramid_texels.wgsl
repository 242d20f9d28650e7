// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: the texels of prefiltered voxels, one by one, in buffers.
//!
//! Interface: `pyramid`, `load_texel` of the volume that is read, `store_texel` to the one that is written.
#define_import_path lucerna::fields::pyramid_texels

#import lucerna::cone::pyramid::PyramidLayout
#import lucerna::math::half::pack_half

@group(2) @binding(0) var<uniform> pyramid: PyramidLayout;
@group(2) @binding(1) var<storage, read> source: array<vec2<u32>>;
@group(2) @binding(2) var<storage, read_write> target_volume: array<vec2<u32>>;

/// Where a texel stands in its volume, x fastest.
fn index_of(volume: u32, place: vec3<u32>) -> u32 {
    var size = pyramid.volume_base;
    if volume == 1u {
        size = pyramid.volume_odd;
    } else if volume == 2u {
        size = pyramid.volume_even;
    }
    return (place.z * size.y + place.y) * size.x + place.x;
}

/// `volume`: which one `source` is.
fn load_texel(volume: u32, place: vec3<u32>) -> vec4<f32> {
    let words = source[index_of(volume, place)];
    return vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
}

/// `volume`: which one the target is.
fn store_texel(volume: u32, place: vec3<u32>, texel: vec4<f32>) {
    target_volume[index_of(volume, place)] = vec2<u32>(pack_half(texel.rg), pack_half(texel.ba));
}
