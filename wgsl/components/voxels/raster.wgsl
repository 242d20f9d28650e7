// SPDX-License-Identifier: MIT OR Apache-2.0
//! Triangles of a grid in a picture: a pixel is a column of cells along an axis.
//!
//! For the voxelizers that let the rasteriser find the columns: three pictures, one along each axis
//! (A. Kaufman, E. Shimony, "3D Scan-Conversion Algorithms for Voxel-Based Graphics", I3D 1986, in
//! today's form), or one in which each triangle is seen along its dominant axis (C. Crassin, S.
//! Green, "Octree-Based Sparse Voxelization", OpenGL Insights, 2012).
#define_import_path lucerna::components::voxels::raster

#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{Columns, GridTriangle, columns_of_triangle, sides_of_axis}

/// The value that means each triangle's own dominant axis.
const AXIS_DOMINANT: u32 = 3u;

/// Along which axis a triangle is seen. `axis`: 0, 1, 2 or AXIS_DOMINANT.
fn axis_of_view(grid: VoxelGrid, t: GridTriangle, axis: u32) -> u32 {
    if axis < AXIS_DOMINANT {
        return axis;
    }
    return columns_of_triangle(grid, t).axis;
}

/// Position of a column in a picture of `side` × `side` pixels, in clip space. `point`: along the two other axes, in
/// cells.
fn clip_from_columns(point: vec2<f32>, side: f32) -> vec4<f32> {
    // Rows of the picture run down.
    return vec4<f32>(point.x / side * 2.0 - 1.0, 1.0 - point.y / side * 2.0, 0.5, 1.0);
}

/// A point of a grid, seen along an axis, in clip space.
fn clip_from_grid(point: vec3<f32>, axis: u32, side: f32) -> vec4<f32> {
    let sides = sides_of_axis(axis);
    return clip_from_columns(vec2<f32>(point[sides.x], point[sides.y]), side);
}

/// Corner (0 to 5, two triangles) of the rectangle around a triangle's columns, in cells.
fn corner_of_columns(columns: Columns, corner: u32) -> vec2<f32> {
    // 0 1 2, 2 1 3 of the corners (0, 0), (1, 0), (0, 1), (1, 1).
    let ix = select(corner, array<u32, 3>(2u, 1u, 3u)[corner % 3u], corner >= 3u);
    let sides = sides_of_axis(columns.axis);
    let first = vec2<f32>(f32(columns.first[sides.x]), f32(columns.first[sides.y]));
    let end = vec2<f32>(f32(columns.end[sides.x]), f32(columns.end[sides.y]));
    return select(first, end, vec2<bool>((ix & 1u) != 0u, (ix & 2u) != 0u));
}
