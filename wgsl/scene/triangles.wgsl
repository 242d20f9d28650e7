// SPDX-License-Identifier: MIT OR Apache-2.0
//! Scene seam: the triangles themselves, for the voxelizer and the rasteriser.
//!
//! Interface: `n_triangles`, `triangle_corners`, `triangle_moves`, `triangle_is_masked`.
#define_import_path lucerna::scene::triangles

#import lucerna::scene::data::{TRIANGLE_ALPHA_TESTED, TRIANGLE_MOVING, scene, triangles}
#import lucerna::scene::types::TriangleCorners

/// Number of triangles; indices start at 0.
fn n_triangles() -> u32 {
    return scene.n_triangles;
}

/// The corners of a triangle, `triangle_ix` < [`n_triangles`].
fn triangle_corners(triangle_ix: u32) -> TriangleCorners {
    return TriangleCorners(
        triangles[triangle_ix].corner_a,
        triangles[triangle_ix].corner_b,
        triangles[triangle_ix].corner_c,
    );
}

/// Whether the triangle belongs to a moving object.
fn triangle_moves(triangle_ix: u32) -> bool {
    return (triangles[triangle_ix].flags & TRIANGLE_MOVING) != 0u;
}

/// Whether an alpha mask may remove parts of the triangle (`scene::surface::is_cut_away` says which).
fn triangle_is_masked(triangle_ix: u32) -> bool {
    return (triangles[triangle_ix].flags & TRIANGLE_ALPHA_TESTED) != 0u;
}
