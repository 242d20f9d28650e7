// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds up the area of the surfaces in each subvolume of each cell, and how much of it faces each of the cell's corners.
//!
//! Visits the cells as `voxels/mark` does, and all subvolumes of each. A double-sided triangle faces all corners. If the alpha mask removes the
//! middle of the part, it does not count.
//!
//! Dispatch: indirect, from `voxels/work_groups`. Workgroup memory: none. Sums of integers do not depend on the order.

#import lucerna::components::probes::masks::{MASK_BITS, MASK_SIDE, MASK_SUMS, MaskRange, faces_corner, mask_area}
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::{GridTriangle, triangle_meets_cell}
#import lucerna::fields::voxel_structure::{n_slots, slot_in_grid}
#import lucerna::geometry::barycentric::barycentrics_within
#import lucerna::geometry::clip::clip_triangle_to_cube
#import lucerna::integrators::triangle_pieces::{next_cell, walk_piece}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::surface::surface_over
#import lucerna::scene::triangles::triangle_corners

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> range: MaskRange;
/// MASK_BITS · MASK_SUMS for each voxel of the range, at first 0.
@group(1) @binding(2) var<storage, read_write> areas: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    // Ranges beyond the last voxel have nothing to do.
    if range.first >= n_slots(grid) {
        return;
    }
    var walk = walk_piece(grid, group_of_dispatch(group) * WORKGROUP + local);
    while next_cell(&walk) {
        let slot = slot_in_grid(grid, 0u, vec3<i32>(walk.cell));
        if slot == NO_SLOT || slot < range.first || slot - range.first >= range.n {
            continue;
        }
        // In units of subvolumes.
        let fine = f32(MASK_SIDE);
        let t = GridTriangle(walk.piece.triangle.a * fine, walk.piece.triangle.b * fine, walk.piece.triangle.c * fine);
        let low = min(t.a, min(t.b, t.c));
        let high = max(t.a, max(t.b, t.c));
        let corners = triangle_corners(walk.piece.triangle_ix);
        let normal = cross(corners.b - corners.a, corners.c - corners.a);
        for (var bit = 0u; bit < MASK_BITS; bit++) {
            let inside = vec3<u32>(bit, bit / MASK_SIDE, bit / (MASK_SIDE * MASK_SIDE)) % MASK_SIDE;
            let subvolume = walk.cell * MASK_SIDE + inside;
            let at = vec3<f32>(subvolume);
            if any(low > at + 1.0) || any(high < at) || !triangle_meets_cell(t, subvolume) {
                continue;
            }
            let part = clip_triangle_to_cube(t.a, t.b, t.c, vec3<f32>(subvolume) + 0.5, 0.5);
            let surface = surface_over(
                walk.piece.triangle_ix,
                barycentrics_within(part.middle, t.a, t.b, t.c),
                grid.cell / fine,
            );
            if surface.is_cut_away {
                continue;
            }
            let area = mask_area(length(part.area));
            let first = ((slot - range.first) * MASK_BITS + bit) * MASK_SUMS;
            atomicAdd(&areas[first], area);
            for (var corner = 0u; corner < 8u; corner++) {
                if surface.double_sided || faces_corner(normal, corner) {
                    atomicAdd(&areas[first + 1u + corner], area);
                }
            }
        }
    }
}
