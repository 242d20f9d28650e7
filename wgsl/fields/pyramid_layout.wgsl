// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: the layout of the levels of prefiltered voxels, without their texels.
//!
//! Interface: `pyramid`, `finest_cell`.
#define_import_path lucerna::fields::pyramid_layout

#import lucerna::components::voxel_pyramid::layout::{PyramidLayout, pyramid_weight}

@group(3) @binding(16) var<uniform> pyramid: PyramidLayout;

/// Edge of the smallest cells that the levels have at a point [m].
fn finest_cell(position: vec3<f32>) -> f32 {
    for (var ix = 0u; ix + 1u < pyramid.n_levels; ix++) {
        let level = pyramid.levels[ix];
        if pyramid_weight(level, 0.0, (position - level.origin) / level.cell) > 0.0 {
            return level.cell;
        }
    }
    return pyramid.levels[pyramid.n_levels - 1u].cell;
}
