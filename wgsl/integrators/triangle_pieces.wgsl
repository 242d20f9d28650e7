// SPDX-License-Identifier: MIT OR Apache-2.0
//! A piece of the voxelizer's work: a few columns of cells over one triangle (`lucerna::components::voxels::work`).
//!
//! Bindings: none of its own; it uses `fields::triangle_work` and the scene seam.
#define_import_path lucerna::integrators::triangle_pieces

#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{COLUMNS, Columns, GridTriangle, columns_of_triangle, grid_triangle}
#import lucerna::fields::triangle_work::{triangle_of_piece, work}
#import lucerna::scene::triangles::{n_triangles, triangle_corners}

/// The work of an invocation: columns `first` to `end` (excluded) of a triangle.
struct TrianglePiece {
    /// Index of the triangle in the scene.
    triangle_ix: u32,
    /// [cells]
    triangle: GridTriangle,
    columns: Columns,
    first: u32,
    end: u32,
}

/// Number of pieces; indices start at 0.
fn n_pieces() -> u32 {
    return work[n_triangles()];
}

/// A piece of work in a grid, `piece` < [`n_pieces`].
fn triangle_piece(grid: VoxelGrid, piece: u32) -> TrianglePiece {
    let ix = triangle_of_piece(n_triangles(), piece);
    let corners = triangle_corners(ix);
    let triangle = grid_triangle(grid, corners.a, corners.b, corners.c);
    let columns = columns_of_triangle(grid, triangle);
    let first = (piece - work[ix]) * COLUMNS;
    return TrianglePiece(ix, triangle, columns, first, min(first + COLUMNS, columns.n));
}
