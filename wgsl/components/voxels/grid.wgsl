// SPDX-License-Identifier: MIT OR Apache-2.0
//! A box of cubic cells and the six faces of each.
//!
//! Cells are counted from the box's minimum corner. Faces are numbered 0 to 5: +X −X +Y −Y +Z −Z.
//! An anisotropic grid stores a value for each face of a cell, for the surfaces that face that way;
//! an isotropic one stores one value per cell (`n_faces` = 1).
#define_import_path lucerna::components::voxels::grid

/// The placement of the cells. Sizes are at least 1 and at most 1023 on each axis.
struct VoxelGrid {
    /// Minimum corner of cell (0, 0, 0) [m].
    origin: vec3<f32>,
    /// Edge of a cell [m], above 0.
    cell: f32,
    /// Cells along each axis.
    size: vec3<u32>,
    /// 1: isotropic; 6: one value per face.
    n_faces: u32,
    /// Bricks along each axis, see `lucerna::components::voxels::bricks`.
    bricks: vec3<u32>,
    /// Number of occupied voxels that there is room for.
    capacity: u32,
}

/// In units of cells from the grid's corner; cell (i, j, k) covers [i, i+1) × [j, j+1) × [k, k+1).
fn grid_from_world(grid: VoxelGrid, position: vec3<f32>) -> vec3<f32> {
    return (position - grid.origin) / grid.cell;
}

/// Inverse of [`grid_from_world`] [m].
fn world_from_grid(grid: VoxelGrid, point: vec3<f32>) -> vec3<f32> {
    return grid.origin + point * grid.cell;
}

/// Whether the cell is inside the grid.
fn is_inside(grid: VoxelGrid, cell: vec3<i32>) -> bool {
    return all(cell >= vec3<i32>(0)) && all(cell < vec3<i32>(grid.size));
}

/// The cell's coordinates in one word, 10 bits per axis, x lowest.
fn pack_cell(cell: vec3<u32>) -> u32 {
    return cell.x | (cell.y << 10u) | (cell.z << 20u);
}

/// Inverse of [`pack_cell`].
fn unpack_cell(packed: u32) -> vec3<u32> {
    return (vec3<u32>(packed) >> vec3<u32>(0u, 10u, 20u)) & vec3<u32>(0x3ffu);
}

/// The axis (0, 1, 2) of a face's normal.
fn face_axis(face: u32) -> u32 {
    return face >> 1u;
}

/// The outward unit normal of a face.
fn face_normal(face: u32) -> vec3<f32> {
    var normal = vec3<f32>(0.0);
    normal[face >> 1u] = select(1.0, -1.0, (face & 1u) != 0u);
    return normal;
}

/// The face of each axis towards which a direction points; the positive one if its component is 0.
fn faces_of_direction(direction: vec3<f32>) -> vec3<u32> {
    return vec3<u32>(0u, 2u, 4u) + select(vec3<u32>(0u), vec3<u32>(1u), direction < vec3<f32>(0.0));
}
