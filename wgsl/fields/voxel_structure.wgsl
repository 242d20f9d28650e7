// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: which cells of a grid are occupied, and where the values of the occupied ones are.
//!
//! Interface: `structure`, `slot_in_grid`, `slot_of_cell`, `n_slots`, `packed_cell_of_slot`, `side_of_record`, `border_of_record`, `first_record_of_face`, `record_for_point`. For kernels that only read
//! it; those that write it bind it themselves. The layout: `lucerna::components::voxels::bricks`.
#define_import_path lucerna::fields::voxel_structure

#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, is_inside}
#import lucerna::components::voxel_light::sides::{FaceSide, is_before_border}
#import lucerna::components::voxels::levels::{VoxelLevel, side_word, slot_word}

/// For each level the bricks' words (occupied bits, first slot), then for each slot a packed cell and 0, then for each
/// record of an anisotropic grid its side (`lucerna::components::voxel_light::sides`; 0 if it is not known).
@group(3) @binding(1) var<storage, read> structure: array<vec2<u32>>;

/// The slot of a cell of a grid, or NO_SLOT; outside the grid there is none. `first_brick`: index of the grid's first
/// brick, 0 if `structure` holds only one grid.
fn slot_in_grid(grid: VoxelGrid, first_brick: u32, cell: vec3<i32>) -> u32 {
    if !is_inside(grid, cell) {
        return NO_SLOT;
    }
    let brick = structure[first_brick + brick_of_cell(grid, vec3<u32>(cell))];
    return slot_in_brick(brick, vec3<u32>(cell));
}

/// The slot of a cell of a level, or NO_SLOT; outside the level's grid there is none.
fn slot_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    return slot_in_grid(level.grid, level.first_brick, cell);
}

/// Number of slots, if `structure` has only one grid: those before its last brick and in it.
fn n_slots(grid: VoxelGrid) -> u32 {
    let last = structure[grid.bricks.x * grid.bricks.y * grid.bricks.z - 1u];
    return last.y + countOneBits(last.x);
}

/// The cell of a slot that exists, packed (`grid::unpack_cell`).
fn packed_cell_of_slot(level: VoxelLevel, slot: u32) -> u32 {
    return structure[slot_word(level, slot)].x;
}

/// The side of a record that exists, counted in the level, of an anisotropic grid.
fn side_of_record(level: VoxelLevel, record: u32) -> FaceSide {
    let at = side_word(level, record);
    let seen = structure[at];
    let border = structure[at + 1u];
    return FaceSide(seen.x, seen.y, border.x, border.y);
}

/// The border and the other record of a face's first record ([`FaceSide`]).
fn border_of_record(level: VoxelLevel, record: u32) -> vec2<u32> {
    return structure[side_word(level, record) + 1u];
}

/// The first record of a record's face: itself, or that of which it is the second. `n_voxels`: of the level. `record`: of any grid.
fn first_record_of_face(level: VoxelLevel, n_voxels: u32, record: u32) -> u32 {
    if record < n_voxels * level.grid.n_faces {
        return record;
    }
    return border_of_record(level, record).y;
}

/// The record of a face for a point, of an anisotropic grid. `first`: its first one; `point`: from the corner of the
/// record's cell [cells].
fn record_for_point(level: VoxelLevel, first: u32, point: vec3<f32>) -> u32 {
    let border = border_of_record(level, first);
    return select(first, border.y - 1u, border.y != 0u && !is_before_border(border.x, point));
}
