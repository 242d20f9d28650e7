// SPDX-License-Identifier: MIT OR Apache-2.0
//! Computes a mip of a level from the one below, for every face: `components::voxel_pyramid::prefilter`.
//!
//! Dispatch: ceil(size/4) groups of 4 × 4 × 4, of the mip that is made. Workgroup memory: none. Each invocation owns its
//! cell's texels. Children outside the grid are the border's empty texels.

#import lucerna::components::voxel_pyramid::prefilter::{add_column, child_offset, parent_of_columns}
#import lucerna::components::voxel_pyramid::layout::{MAX_MIPS, PyramidMip, texel_of_cell, volume_of_mip}
#import lucerna::fields::pyramid_texels::{filled, load_texel, store_texel}

const SIDE: u32 = 4u;

struct PrefilterInfo {
    /// Index of the level.
    level: u32,
    /// The mip to compute, at least 1.
    mip: u32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> info: PrefilterInfo;

@compute @workgroup_size(SIDE, SIDE, SIDE)
fn main(@builtin(global_invocation_id) cell: vec3<u32>) {
    let entry = info.level * MAX_MIPS + info.mip;
    let parent = filled.mips[entry];
    if any(cell >= parent.size) {
        return;
    }
    let children = filled.mips[entry - 1u];
    let volume = volume_of_mip(info.mip - 1u);
    for (var face = 0u; face < filled.n_faces; face++) {
        var sum = vec4<f32>(0.0);
        // A single value for all sides is the mean of what all sides would see.
        let n_sides = select(1u, 6u, filled.n_faces == 1u);
        for (var ix = 0u; ix < 4u * n_sides; ix++) {
            let side = select(face, ix >> 2u, n_sides == 6u);
            let front = 2u * cell + child_offset(side, ix & 3u, 0u);
            let back = 2u * cell + child_offset(side, ix & 3u, 1u);
            sum = add_column(
                sum,
                child(children, volume, face, front),
                child(children, volume, face, back),
            );
        }
        let place = texel_of_cell(parent, face, vec3<i32>(cell));
        store_texel(volume_of_mip(info.mip), place, parent_of_columns(sum / f32(n_sides)));
    }
}

fn child(children: PyramidMip, volume: u32, face: u32, cell: vec3<u32>) -> vec4<f32> {
    // (A cell beyond the last one is the border's.)
    return load_texel(volume, texel_of_cell(children, face, vec3<i32>(cell)));
}
