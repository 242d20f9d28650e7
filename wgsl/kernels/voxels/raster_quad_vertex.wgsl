// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rasterised voxelization, for comparison: the rectangle around each triangle's columns, instead of conservative
//! rasterisation, which WebGPU does not have.
//!
//! Dispatch: none; a draw of 6·n_triangles vertices, with `voxels/raster_quad_fragment`.

#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::raster::{clip_from_columns, corner_of_columns}
#import lucerna::components::voxels::work::{GridTriangle, columns_of_triangle}

struct RasterView {
    /// Pixels along each side of the picture.
    side: u32,
    /// Not used: the axis is each triangle's own.
    axis: u32,
}

struct VertexOutput {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> view: RasterView;
@group(1) @binding(2) var<storage, read> corners: array<GridTriangle>;

@vertex
fn main(@builtin(vertex_index) vertex: u32) -> VertexOutput {
    let triangle = vertex / 6u;
    let columns = columns_of_triangle(grid, corners[triangle]);
    let point = corner_of_columns(columns, vertex % 6u);
    return VertexOutput(clip_from_columns(point, f32(view.side)), triangle);
}
