// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rasterised voxelization, for comparison: triangles seen along an axis.
//!
//! Dispatch: none; a draw of 3·n_triangles vertices, with `voxels/raster_fragment`.

#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::raster::{axis_of_view, clip_from_grid}
#import lucerna::components::voxels::work::GridTriangle

struct RasterView {
    /// Pixels along each side of the picture.
    side: u32,
    /// 0, 1, 2 or AXIS_DOMINANT.
    axis: u32,
}

struct VertexOutput {
    @builtin(position) position: vec4<f32>,
    /// In cells.
    @location(0) point: vec3<f32>,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> view: RasterView;
@group(1) @binding(2) var<storage, read> corners: array<GridTriangle>;

@vertex
fn main(@builtin(vertex_index) vertex: u32) -> VertexOutput {
    let t = corners[vertex / 3u];
    let axis = axis_of_view(grid, t, view.axis);
    let corner = vertex % 3u;
    let point = select(select(t.a, t.b, corner == 1u), t.c, corner == 2u);
    return VertexOutput(clip_from_grid(point, axis, f32(view.side)), point);
}
