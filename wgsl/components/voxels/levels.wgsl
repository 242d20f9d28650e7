// SPDX-License-Identifier: MIT OR Apache-2.0
//! Nested grids around the eye: each level has cells twice as large as the one before.
//!
//! F. Losasso, H. Hoppe, "Geometry Clipmaps", SIGGRAPH 2004, in three dimensions (C. Crassin et al., "Interactive
//! Indirect Illumination Using Voxel Cone Tracing", 2011, and its successors). A single grid is a clip map of one
//! level.
#define_import_path lucerna::components::voxels::levels

#import lucerna::components::voxels::grid::VoxelGrid

/// The most levels.
const MAX_LEVELS: u32 = 6u;
/// The outermost cells of a level, over which it fades into the next.
const FADE_CELLS: f32 = 4.0;

/// A level, and where its data are in the buffers that all levels share.
struct VoxelLevel {
    grid: VoxelGrid,
    /// Index of the level's first brick.
    first_brick: u32,
    /// Index of its first record.
    first_record: u32,
    /// Index of the word pair of its first record's side.
    first_side: u32,
    reserved: u32,
}

/// From the finest to the coarsest.
struct VoxelLevels {
    levels: array<VoxelLevel, MAX_LEVELS>,
    n_levels: u32,
    /// 1: nearly all light has arrived (`kernels::convergence::compare`), so that fewer samples keep it.
    is_settled: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// Weight of a level at a point in its grid's units: 1 inside, falling to 0 half a cell within its border (beyond which
/// taps would be outside).
fn level_weight(grid: VoxelGrid, point: vec3<f32>) -> f32 {
    let inside = min(point, vec3<f32>(grid.size) - point) - 0.5;
    return clamp(min(inside.x, min(inside.y, inside.z)) / FADE_CELLS, 0.0, 1.0);
}

/// Index of the first of the two word pairs that hold a record's side (`lucerna::components::voxel_light::sides`), `record`
/// counted in the level.
fn side_word(level: VoxelLevel, record: u32) -> u32 {
    return level.first_side + 2u * record;
}

/// Index of the word pair that holds a slot's cell.
fn slot_word(level: VoxelLevel, slot: u32) -> u32 {
    return level.first_brick + level.grid.bricks.x * level.grid.bricks.y * level.grid.bricks.z + slot;
}
