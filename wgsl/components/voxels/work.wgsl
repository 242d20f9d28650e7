// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which cells a triangle intersects, cut into pieces of work of about the same size.
//!
//! A triangle is viewed along its dominant axis, where its normal is longest. The cells of its box form columns along
//! that axis, and in a column it intersects few cells, because its slope is at most 1 along either side (M. Schwarz,
//! H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs", ACM TOG 29(6), 2010). COLUMNS columns are one
//! piece of work, so that a large wall is not left to one invocation. Only `geometry::triangle_box` decides about a
//! cell; the columns only skip cells that it would reject.
//!
//! Borders: a cell is closed, so a triangle that lies on a border, or touches it, intersects the cells on both sides.
#define_import_path lucerna::components::voxels::work

#import lucerna::geometry::triangle_box::triangle_overlaps_box
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world}

/// Columns of a piece of work.
const COLUMNS: u32 = 16u;
/// Triangles that reach farther than this from the grid's corner [cells] are left out: f32 cannot tell which cell their
/// corners are in, and still farther away the products of lengths in the test exceed its range.
const FARTHEST: f32 = 1.6e7;

/// A triangle in units of cells from the grid's corner.
struct GridTriangle {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
}

/// The part of the grid around a triangle, as columns.
struct Columns {
    /// First cell, and one past the last; all 0 if the triangle is outside.
    first: vec3<u32>,
    end: vec3<u32>,
    /// Axis of the columns: 0, 1, 2.
    axis: u32,
    /// Number of columns.
    n: u32,
    /// cross(b − a, c − a)
    normal: vec3<f32>,
}

/// Corners from world space [m] to cells.
fn grid_triangle(grid: VoxelGrid, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> GridTriangle {
    return GridTriangle(
        grid_from_world(grid, a),
        grid_from_world(grid, b),
        grid_from_world(grid, c),
    );
}

/// The columns of the grid that the triangle's box touches.
fn columns_of_triangle(grid: VoxelGrid, t: GridTriangle) -> Columns {
    var columns = Columns();
    let low = min(t.a, min(t.b, t.c));
    let high = max(t.a, max(t.b, t.c));
    let size = vec3<f32>(grid.size);
    // Cells are closed: one that only touches the box counts. Also false for NaN.
    let meets = all(low <= size) && all(high >= vec3<f32>(0.0));
    if !(meets && all(low >= vec3<f32>(-FARTHEST)) && all(high <= vec3<f32>(FARTHEST))) {
        return columns;
    }
    columns.first = vec3<u32>(clamp(ceil(low) - 1.0, vec3<f32>(0.0), size - 1.0));
    columns.end = vec3<u32>(clamp(floor(high), vec3<f32>(0.0), size - 1.0)) + 1u;
    columns.normal = cross(t.b - t.a, t.c - t.a);
    let steep = abs(columns.normal);
    columns.axis = select(
        select(2u, 1u, steep.y >= steep.z),
        0u,
        steep.x >= steep.y && steep.x >= steep.z,
    );
    let cells = columns.end - columns.first;
    let side = sides_of_axis(columns.axis);
    columns.n = cells[side.x] * cells[side.y];
    return columns;
}

/// The two other axes.
fn sides_of_axis(axis: u32) -> vec2<u32> {
    return vec2<u32>(select(0u, 1u, axis == 0u), select(2u, 1u, axis == 2u));
}

/// Number of pieces of work of a triangle.
fn n_work_of_columns(columns: Columns) -> u32 {
    return (columns.n + COLUMNS - 1u) / COLUMNS;
}

/// In xyz, the first cell of a column (`ix` below `columns.n`) that the triangle may intersect, and in w one past the
/// last along the column's axis.
fn cells_of_column(t: GridTriangle, columns: Columns, ix: u32) -> vec4<u32> {
    let side = sides_of_axis(columns.axis);
    let width = columns.end[side.x] - columns.first[side.x];
    var cell = columns.first;
    cell[side.x] += ix % width;
    cell[side.y] += ix / width;
    var end = columns.end[columns.axis];
    let steep = abs(columns.normal[columns.axis]);
    if steep > 0.0 {
        // The plane over the middle of the column's cross-section, and how far it rises to the
        // corners of it.
        let slope = vec2<f32>(columns.normal[side.x], columns.normal[side.y])
            / columns.normal[columns.axis];
        let middle = vec2<f32>(f32(cell[side.x]), f32(cell[side.y])) + 0.5;
        let offset = middle - vec2<f32>(t.a[side.x], t.a[side.y]);
        let depth = t.a[columns.axis] - dot(slope, offset);
        // The error of a normal from edges of length L is some roundings (6e-8) of L²; that tilts the plane by this
        // over the normal's length, and moves it by that times the distance.
        let longest = max(
            dot(t.b - t.a, t.b - t.a),
            max(dot(t.c - t.a, t.c - t.a), dot(t.c - t.b, t.c - t.b)),
        );
        let distance = abs(offset.x) + abs(offset.y) + 1.0;
        let size = max(abs(t.a[columns.axis]), distance);
        let slack = 1e-3 + 2e-6 * size + 4e-6 * distance * (longest / steep);
        let reach = 0.5 * (abs(slope.x) + abs(slope.y)) + slack;
        let low = f32(cell[columns.axis]);
        let high = f32(end);
        // If the slack is infinite, the clamp keeps the whole column.
        cell[columns.axis] = u32(clamp(ceil(depth - reach) - 1.0, low, high));
        end = u32(clamp(floor(depth + reach) + 1.0, low, high));
    }
    return vec4<u32>(cell, end);
}

/// Whether the triangle intersects a cell, borders included.
fn triangle_meets_cell(t: GridTriangle, cell: vec3<u32>) -> bool {
    return triangle_overlaps_box(t.a, t.b, t.c, vec3<f32>(cell) + 0.5, vec3<f32>(0.5));
}
