// SPDX-License-Identifier: MIT OR Apache-2.0
//! Adds the attributes of every triangle to the voxels that it intersects.
//!
//! Visits the cells as `voxels/mark` does. A triangle is weighted in a cell by its area within it. Anisotropic: it adds
//! to the face of each axis that its front faces, weighted by the area projected onto it (A·max(dot(axis, n), 0), the
//! weights of T. Magalhães 2020 times the area); a double-sided triangle also adds to the opposite face, reversed.
//! Isotropic: weighted by the area. A triangle that only touches the cell has the smallest weight, so no voxel is
//! without values. If the alpha mask removes the middle of the part, the part does not count.
//!
//! Dispatch: indirect, from `voxels/work_groups`. Workgroup memory: none. Sums of integers do not
//! depend on the order.

#import lucerna::integrators::triangle_pieces::{next_cell, walk_piece}
#import lucerna::scene::triangles::triangle_corners
#import lucerna::fields::voxel_structure::{n_slots, slot_in_grid}
#import lucerna::geometry::barycentric::barycentrics_within
#import lucerna::geometry::clip::clip_triangle_to_cube
#import lucerna::scene::surface::surface_over
#import lucerna::scene::types::SurfaceOver
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::vector::safe_normalize
#import lucerna::components::voxels::attributes::{N_SUMS, N_SURFACE_SUMS, SUM_COVERAGE, SlotRange}
#import lucerna::components::voxels::attributes::{sums_of_surface, weight_of_part, weights_of_part}
#import lucerna::components::voxels::bricks::NO_SLOT
#import lucerna::components::voxels::grid::VoxelGrid
#import lucerna::components::voxels::work::GridTriangle

const WORKGROUP: u32 = 64u;

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> range: SlotRange;
/// (slot − range.first)·n_faces + face, then SUM_ constant, then low and high word.
@group(1) @binding(2) var<storage, read_write> sums: array<atomic<u32>>;

/// Adds a 64-bit number (low, high).
fn add(record: u32, sum: u32, number: vec2<u32>) {
    let ix = (record * N_SUMS + sum) * 2u;
    var high = number.y;
    if number.x != 0u {
        let before = atomicAdd(&sums[ix], number.x);
        high += u32(before > ~number.x);
    }
    if high != 0u {
        atomicAdd(&sums[ix + 1u], high);
    }
}

/// Adds a surface to a face, with the normal of the side that it shows there.
fn add_face(record: u32, weight: u32, surface: SurfaceOver, normal: vec3<f32>) {
    var numbers = sums_of_surface(weight, surface.albedo, normal, surface.emission, range.brightest);
    for (var k = 0u; k < N_SURFACE_SUMS; k++) {
        add(record, k, numbers[k]);
    }
}

/// Adds a triangle to a voxel of the range.
fn add_triangle(triangle_ix: u32, t: GridTriangle, cell: vec3<u32>, slot: u32) {
    let part = clip_triangle_to_cube(t.a, t.b, t.c, vec3<f32>(cell) + 0.5, 0.5);
    let surface = surface_over(triangle_ix, barycentrics_within(part.middle, t.a, t.b, t.c), grid.cell);
    if surface.is_cut_away {
        return;
    }
    let corners = triangle_corners(triangle_ix);
    let across = cross(corners.b - corners.a, corners.c - corners.a);
    let normal = safe_normalize(across, vec3<f32>(0.0, 1.0, 0.0));
    let first = (slot - range.first) * grid.n_faces;
    if grid.n_faces == 1u {
        let weight = weight_of_part(part.area);
        add_face(first, weight, surface, normal);
        add(first, SUM_COVERAGE, vec2<u32>(weight, 0u));
        return;
    }
    let weights = weights_of_part(part.area, normal);
    for (var axis = 0u; axis < 3u; axis++) {
        let weight = weights[axis];
        if weight == 0u {
            continue;
        }
        let front = first + axis * 2u + u32(normal[axis] < 0.0);
        let back = first + axis * 2u + u32(normal[axis] >= 0.0);
        add_face(front, weight, surface, normal);
        add(front, SUM_COVERAGE, vec2<u32>(weight, 0u));
        add(back, SUM_COVERAGE, vec2<u32>(weight, 0u));
        if surface.double_sided {
            add_face(back, weight, surface, -normal);
        }
    }
}

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) workgroup_id: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    // Ranges beyond the last voxel have nothing to do.
    if range.first >= n_slots(grid) {
        return;
    }
    var walk = walk_piece(grid, group_of_dispatch(workgroup_id) * WORKGROUP + local);
    while next_cell(&walk) {
        let slot = slot_in_grid(grid, 0u, vec3<i32>(walk.cell));
        if slot != NO_SLOT && slot >= range.first && slot - range.first < range.n {
            add_triangle(walk.piece.triangle_ix, walk.piece.triangle, walk.cell, slot);
        }
    }
}
