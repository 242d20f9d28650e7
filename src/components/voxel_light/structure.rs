// SPDX-License-Identifier: MIT OR Apache-2.0
//! The structure of a sparse grid from a list of cells, on the CPU.

use crate::components::voxels::{BRICK, VoxelGrid};
use glam::{UVec3, Vec3};

/// A grid with these cells occupied (duplicates count once), and its structure for
/// [`super::VoxelIrradiance`]: (occupied bits, first slot) of each brick, then (packed cell, 0) of each
/// slot. For voxelizers on the CPU, and for tests.
///
/// `origin` \[m\], `cell` \[m\], `size`, `n_faces`: those of the grid; cells outside it are ignored.
pub fn sparse_grid(
    origin: Vec3,
    cell: f32,
    size: UVec3,
    n_faces: u32,
    cells: &[UVec3],
) -> (VoxelGrid, Vec<[u32; 2]>) {
    let bricks = (size + BRICK - 1) / BRICK;
    let n_bricks = bricks.element_product() as usize;
    let mut structure = vec![[0u32; 2]; n_bricks];
    for cell in cells.iter().filter(|cell| cell.cmplt(size).all()) {
        let (brick, inside) = (*cell / BRICK, *cell % BRICK);
        let brick = (brick.z * bricks.y + brick.y) * bricks.x + brick.x;
        structure[brick as usize][0] |= 1 << ((inside.z * BRICK.y + inside.y) * BRICK.x + inside.x);
    }
    let mut slots = Vec::new();
    for (ix, entry) in structure.iter_mut().enumerate() {
        entry[1] = slots.len() as u32;
        let ix = ix as u32;
        let corner =
            UVec3::new(ix % bricks.x, ix / bricks.x % bricks.y, ix / (bricks.x * bricks.y)) * BRICK;
        for bit in (0..32).filter(|bit| entry[0] & (1 << bit) != 0) {
            let inside =
                UVec3::new(bit % BRICK.x, bit / BRICK.x % BRICK.y, bit / (BRICK.x * BRICK.y));
            let cell = corner + inside;
            slots.push([cell.x | cell.y << 10 | cell.z << 20, 0]);
        }
    }
    let capacity = slots.len().max(1) as u32;
    structure.extend(slots);
    (VoxelGrid { origin, cell, size, n_faces, bricks, capacity }, structure)
}
