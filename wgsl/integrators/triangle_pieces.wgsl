// SPDX-License-Identifier: MIT OR Apache-2.0
//! A piece of the voxelizer's work: a few columns of cells over one triangle (`lucerna::components::voxels::work`).
//!
//! Bindings: none of its own; it uses `fields::triangle_work` and the scene seam.
#define_import_path lucerna::integrators::triangle_pieces

#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{COLUMNS, Columns, GridTriangle, cells_of_column, columns_of_triangle}
#import lucerna::components::voxels::work::{grid_triangle, triangle_meets_cell}
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

/// A walk through the cells that the triangle of a piece intersects.
struct CellWalk {
    piece: TrianglePiece,
    /// The cell where the walk is, once [`next_cell`] has returned true.
    cell: vec3<u32>,
    /// The column's next cell, and one past its last, along its axis.
    next: u32,
    end: u32,
    /// The next column.
    column: u32,
}

/// Starts a walk in front of its first cell. It has no cells if there is no such piece.
fn walk_piece(grid: VoxelGrid, piece: u32) -> CellWalk {
    var walk = CellWalk();
    if piece < n_pieces() {
        walk.piece = triangle_piece(grid, piece);
        walk.column = walk.piece.first;
    }
    return walk;
}

/// Goes to the next cell that the triangle intersects. False: there are no more.
fn next_cell(walk: ptr<function, CellWalk>) -> bool {
    let axis = (*walk).piece.columns.axis;
    var is_found = false;
    while !is_found && ((*walk).next < (*walk).end || (*walk).column < (*walk).piece.end) {
        if (*walk).next < (*walk).end {
            (*walk).cell[axis] = (*walk).next;
            (*walk).next += 1u;
            is_found = triangle_meets_cell((*walk).piece.triangle, (*walk).cell);
        } else {
            let run = cells_of_column((*walk).piece.triangle, (*walk).piece.columns, (*walk).column);
            (*walk).cell = run.xyz;
            (*walk).next = run[axis];
            (*walk).end = run.w;
            (*walk).column += 1u;
        }
    }
    return is_found;
}
