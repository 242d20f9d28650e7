// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rasterised voxelization, for comparison: tests the cells of a fragment's column, as `voxels/mark` does.
//!
//! Dispatch: none; a draw with `voxels/raster_quad_vertex`.

#import lucerna::components::voxels::bricks::{bit_of_cell, brick_of_cell}
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{GridTriangle, cells_of_column, columns_of_triangle, sides_of_axis, triangle_meets_cell}

@group(2) @binding(0) var<uniform> grid: VoxelGrid;
/// One word per brick.
@group(2) @binding(1) var<storage, read_write> bits: array<atomic<u32>>;
@group(2) @binding(2) var<storage, read> corners: array<GridTriangle>;

@fragment
fn main(
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
) {
    let t = corners[triangle];
    let columns = columns_of_triangle(grid, t);
    let sides = sides_of_axis(columns.axis);
    let pixel = vec2<u32>(position.xy);
    let first = vec2<u32>(columns.first[sides.x], columns.first[sides.y]);
    let width = columns.end[sides.x] - first.x;
    let at = pixel - first;
    let run = cells_of_column(t, columns, at.y * width + at.x);
    var cell = run.xyz;
    while cell[columns.axis] < run.w {
        if triangle_meets_cell(t, cell) {
            atomicOr(&bits[brick_of_cell(grid, cell)], 1u << bit_of_cell(cell));
        }
        cell[columns.axis] += 1u;
    }
}
