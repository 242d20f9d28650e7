// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: how the voxelizer's work is cut into pieces (`lucerna::components::voxels::work`).
//!
//! Interface: `work`, `triangle_of_piece`.
#define_import_path lucerna::fields::triangle_work

/// The first piece of each triangle, and at the end the number of pieces; never decreasing.
@group(3) @binding(3) var<storage, read> work: array<u32>;

/// The triangle that a piece belongs to: the last one whose first piece is not above it, by bisection.
///
/// `n_triangles` ≥ 1; `piece` < `work[n_triangles]`.
fn triangle_of_piece(n_triangles: u32, piece: u32) -> u32 {
    var low = 0u;
    var high = n_triangles;
    while high - low > 1u {
        let middle = (low + high) / 2u;
        if work[middle] <= piece {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}
