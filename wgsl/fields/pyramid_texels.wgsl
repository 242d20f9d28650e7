// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: the single texels of prefiltered voxels, for kernels that compute them.
//!
//! Interface: `filled`, `load_texel` of the volume that is read, `store_texel` to the one that is written. This one has
//! textures; the variant `volumes=buffers` has buffers.
#define_import_path lucerna::fields::pyramid_texels

#import lucerna::components::voxel_pyramid::layout::PyramidLayout

@group(3) @binding(24) var<uniform> filled: PyramidLayout;
@group(3) @binding(25) var source_volume: texture_3d<f32>;
@group(3) @binding(26) var target_volume: texture_storage_3d<rgba16float, write>;

/// `volume`: which one `source_volume` is.
fn load_texel(volume: u32, place: vec3<u32>) -> vec4<f32> {
    return textureLoad(source_volume, place, 0);
}

/// `volume`: which one the target is.
fn store_texel(volume: u32, place: vec3<u32>, texel: vec4<f32>) {
    textureStore(target_volume, place, texel);
}
