// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: which cells of a grid are occupied, and where the values of the occupied ones are.
//!
//! Interface: `structure`, `slot_in_grid`, `slot_of_cell`, `n_slots`, `packed_cell_of_slot`, `wall_word_of_slot`. For kernels that only read
//! it; those that write it bind it themselves. The layout: `lucerna::components::voxels::bricks`.
#define_import_path lucerna::fields::voxel_structure

#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, is_inside}
#import lucerna::components::voxels::levels::{VoxelLevel, slot_word}

/// For each level the bricks' words (occupied bits, first slot), then for each slot a packed cell and its walls
/// (`lucerna::components::voxel_light::wall_words`; 0 if no walls have been marked).
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

/// The walls of the voxel in a slot that exists (`lucerna::components::voxel_light::wall_words`).
fn wall_word_of_slot(level: VoxelLevel, slot: u32) -> u32 {
    return structure[slot_word(level, slot)].y;
}
