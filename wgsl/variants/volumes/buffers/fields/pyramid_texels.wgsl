// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: the single texels of prefiltered voxels, in a buffer.
//!
//! Interface: `filled`, `load_texel` of the volume that is read, `store_texel` to the one that is written.
#define_import_path lucerna::fields::pyramid_texels

#import lucerna::components::voxel_pyramid::layout::{PyramidLayout, VolumeSizes, index_of_texel}
#import lucerna::math::half::pack_half

@group(3) @binding(24) var<uniform> filled: PyramidLayout;
/// The three volumes, one after the other.
@group(3) @binding(25) var<storage, read_write> filled_texels: array<vec2<u32>>;

/// Index of a texel of a volume.
fn texel_ix(volume: u32, place: vec3<u32>) -> u32 {
    let sizes = VolumeSizes(filled.volume_base, filled.volume_odd, filled.volume_even);
    return index_of_texel(sizes, volume, place);
}

/// `volume`: which one is read.
fn load_texel(volume: u32, place: vec3<u32>) -> vec4<f32> {
    let words = filled_texels[texel_ix(volume, place)];
    return vec4<f32>(unpack2x16float(words.x), unpack2x16float(words.y));
}

/// `volume`: which one is written.
fn store_texel(volume: u32, place: vec3<u32>, texel: vec4<f32>) {
    filled_texels[texel_ix(volume, place)] = vec2<u32>(pack_half(texel.rg), pack_half(texel.ba));
}
