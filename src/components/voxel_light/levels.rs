// SPDX-License-Identifier: MIT OR Apache-2.0
//! The layout of the grids: as fine as the camera's surroundings require, and as wide as what can be seen.

use super::{FaceLight, Levels, VoxelLightError, VoxelLightSettings};
use crate::bindings::lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels};
use crate::components::voxels::{BRICK, MAX_BINDING, VoxelGrid, grid_for_bounds};
use crate::seam::{SceneSeam, Surroundings};
use glam::{IVec3, UVec3, Vec3};
use std::mem::offset_of;

/// The number of levels that the uniform has room for.
pub(super) const MAX_LEVELS: u32 =
    (offset_of!(VoxelLevels, n_levels) / size_of::<VoxelLevel>()) as u32;

/// A level follows the eye in steps of this many cells.
const SCROLL_STEP: i32 = 8;

/// Width of the finest grid if [`Levels::Auto`] makes several, in median distances: about the size of a church or an
/// atrium around someone who is in it.
const WANTED_WIDTH: f32 = 8.0;
/// One grid is fine enough for a scene that is no wider than this many median distances.
const ENOUGH_WIDTH: f32 = 16.0;
/// The most levels that [`Levels::Auto`] makes.
const MAX_AUTO_LEVELS: u32 = 4;
/// With fewer cells than this within the median distance there is a warning.
const COARSE_CELLS: f32 = 4.0;
/// What is more than this many times as far away as the farthest visible surface gets no voxels, so that a stray
/// triangle does not make the cells large.
const FARTHEST_TIMES: f32 = 1024.0;

/// How fine and how wide the grids are.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct VoxelReach {
    /// Edge of the finest cells \[m\].
    pub finest_cell: f32,
    /// Edge of the coarsest cells \[m\].
    pub coarsest_cell: f32,
    /// What was around the eye; None if nothing could be seen from there.
    pub surroundings: Option<Surroundings>,
    /// Whether the scene's box reaches beyond the coarsest grid: what is there is too far away, and has no voxels.
    pub is_cut: bool,
}

impl VoxelReach {
    /// Whether the finest cells are so large, compared with what is around the eye (fewer than 4 within the median
    /// distance), that light is wrong.
    pub fn is_coarse(&self) -> bool {
        self.surroundings.is_some_and(|around| self.finest_cell * COARSE_CELLS > around.median)
    }
}

/// The levels' grids: finer ones around the eye, each with its position in the world's grid of cells of its size, and
/// the grid of the whole scene.
pub(super) fn grids(
    scene: &dyn SceneSeam,
    settings: &VoxelLightSettings,
    n_faces: u32,
    limit: u64,
    eye: Vec3,
) -> Result<(Vec<(VoxelGrid, IVec3)>, VoxelReach), VoxelLightError> {
    let around = scene.surroundings(eye);
    let (scene_min, scene_max) = (scene.facts().bounds_min, scene.facts().bounds_max);
    let (mut min, mut max) = (scene_min, scene_max);
    if let Some(around) = around {
        let reach = Vec3::splat(FARTHEST_TIMES * around.farthest);
        let (low, high) = (eye - reach, eye + reach);
        if min.cmplt(low).any() || max.cmpgt(high).any() {
            (min, max) = scene.bounds_within(low, high).unwrap_or((min, max));
        }
    }
    let whole = grid_for_bounds(min, max, settings.resolution, n_faces, None)?;
    let longest = settings.longest();
    let n_cells = longest as f32;
    let median = around.map_or(f32::INFINITY, |around| around.median);
    let wanted = WANTED_WIDTH * median / n_cells;
    let (n_levels, finest) = match settings.levels {
        Levels::Nested(n) => (n, whole.cell * 0.5f32.powi(n as i32 - 1)),
        Levels::Auto if (max - min).max_element() <= ENOUGH_WIDTH * median => (1, whole.cell),
        Levels::Auto => {
            // Cells are halved from the whole scene's on, if that reaches the wanted size; otherwise the step to the
            // whole scene is larger.
            let halvings = (whole.cell / wanted).log2().ceil().max(1.0) as u32;
            let n = (halvings + 1).min(MAX_AUTO_LEVELS);
            let reached = whole.cell * 0.5f32.powi(n as i32 - 1);
            (n, if halvings < MAX_AUTO_LEVELS { reached } else { wanted })
        }
    };
    // The memory that the light of all levels together may take.
    let room = limit.min(MAX_BINDING) / (size_of::<FaceLight>() as u64 * u64::from(n_faces));
    let room = (room / u64::from(n_levels)).max(1) as u32;
    let whole = VoxelGrid { capacity: whole.capacity.min(room), ..whole };
    let size = UVec3::splat(longest);
    let bricks = (size + BRICK - 1) / BRICK;
    let capacity = (16 * size.x * size.y).min(size.element_product()).min(room);
    let finer = (0..n_levels - 1).map(|level| {
        let cell = finest * 2f32.powi(level as i32);
        let mut grid = VoxelGrid { origin: Vec3::ZERO, cell, size, n_faces, bricks, capacity };
        let corner = corner_around(eye, &grid);
        grid.origin = corner.as_vec3() * cell;
        (grid, corner)
    });
    let reach = VoxelReach {
        finest_cell: finest,
        coarsest_cell: whole.cell,
        surroundings: around,
        is_cut: min != scene_min || max != scene_max,
    };
    Ok((finer.chain([(whole, IVec3::ZERO)]).collect(), reach))
}

/// Where a level starts so that the eye is in its middle, in steps of a few cells.
pub(super) fn corner_around(eye: Vec3, grid: &VoxelGrid) -> IVec3 {
    let middle = (eye / (grid.cell * SCROLL_STEP as f32)).round().as_ivec3() * SCROLL_STEP;
    middle - (grid.size / 2).as_ivec3()
}
