// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which voxels are occupied, and where the values of the occupied ones are.
//!
//! Surfaces fill a small share of a grid, so values are stored only for occupied voxels, in one array ordered by brick.
//! A brick is 4 × 4 × 2 cells. For each, one word says which of its 32 cells are occupied, and another how many voxels
//! come before it. A voxel's place (its *slot*) is that number plus the count of lower bits: G. Jacobson,
//! "Space-efficient Static Trees and Graphs", FOCS 1989 (rank by popcount). 256³ cells take 4 MiB, and the order does
//! not depend on the order of work.
#define_import_path lucerna::components::voxels::bricks

#import lucerna::components::voxels::grid::VoxelGrid

/// Cells of a brick along each axis.
const BRICK: vec3<u32> = vec3<u32>(4u, 4u, 2u);
/// Not occupied.
const NO_SLOT: u32 = 0xffffffffu;

/// Index of the brick of a cell inside the grid, x fastest.
fn brick_of_cell(grid: VoxelGrid, cell: vec3<u32>) -> u32 {
    let brick = cell / BRICK;
    return (brick.z * grid.bricks.y + brick.y) * grid.bricks.x + brick.x;
}

/// The cell's bit within its brick, 0 to 31, x fastest.
fn bit_of_cell(cell: vec3<u32>) -> u32 {
    let inside = cell % BRICK;
    return (inside.z * BRICK.y + inside.y) * BRICK.x + inside.x;
}

/// The cell of a brick's bit; inverse of [`brick_of_cell`] with [`bit_of_cell`].
fn cell_of_bit(grid: VoxelGrid, brick: u32, bit: u32) -> vec3<u32> {
    let corner = vec3<u32>(
        brick % grid.bricks.x,
        (brick / grid.bricks.x) % grid.bricks.y,
        brick / (grid.bricks.x * grid.bricks.y),
    );
    let inside = vec3<u32>(bit % BRICK.x, (bit / BRICK.x) % BRICK.y, bit / (BRICK.x * BRICK.y));
    return corner * BRICK + inside;
}

/// The slot of a brick's bit, or NO_SLOT. `occupied`, `first`: the brick's two words.
fn slot_of_bit(occupied: u32, first: u32, bit: u32) -> u32 {
    if (occupied & (1u << bit)) == 0u {
        return NO_SLOT;
    }
    return first + countOneBits(occupied & ((1u << bit) - 1u));
}

/// The slot of a cell, or NO_SLOT. `brick`: the two words of its brick ([`brick_of_cell`]).
fn slot_in_brick(brick: vec2<u32>, cell: vec3<u32>) -> u32 {
    return slot_of_bit(brick.x, brick.y, bit_of_cell(cell));
}
