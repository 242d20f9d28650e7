// SPDX-License-Identifier: MIT OR Apache-2.0
//! A voxel's word of where walls are within it, and how look-ups stay in front of them, so that light is not read
//! through walls.
//!
//! If only the +X face of a cell is walled, then for a point in it everything towards −X is behind that wall, and the
//! light of cells there must not be mixed in. If both faces of an axis are walled, there is a thin sheet within the
//! cell: the point is on one side of it, and what the cell stores for its other faces is a mixture of both sides. (When
//! a face counts as walled: `walls`.)
//!
//! The word: bits 0–5, one bit per walled face (+X −X +Y −Y +Z −Z); then for each axis 6 bits for the position of the
//! sheet's middle within the cell (in 1/63 of a cell).
#define_import_path lucerna::components::voxel_light::wall_words

/// Weight of the other faces of a cell that a sheet divides.
const DIVIDED_WEIGHT: f32 = 0.01;

/// An axis's bits of the word. `middle`: that of the sheet, in [0, 1] cells; clamped.
fn wall_bits(axis: u32, plus_walled: bool, minus_walled: bool, middle: f32) -> u32 {
    let place = u32(clamp(middle, 0.0, 1.0) * 63.0 + 0.5);
    return (select(0u, 1u, plus_walled) << (2u * axis))
        | (select(0u, 2u, minus_walled) << (2u * axis))
        | (place << (6u + 6u * axis));
}

/// Which of an axis's faces are walled: bit 0 the positive one, bit 1 the negative one.
fn walled_faces(walls: u32, axis: u32) -> u32 {
    return (walls >> (2u * axis)) & 3u;
}

/// Moves a look-up away from what is behind the walls of its surface's cell.
///
/// `walls`: the word of that cell. `at`: the surface point and `point`: where the grid is read, both in units of cells;
/// `cell`: the surface's.
fn keep_before_walls(walls: u32, at: vec3<f32>, cell: vec3<f32>, point: vec3<f32>) -> vec3<f32> {
    var out = point;
    for (var axis = 0u; axis < 3u; axis++) {
        let walled = walled_faces(walls, axis);
        var low = cell[axis] + 0.5;
        var high = low;
        var keep_above = walled == 1u;
        if walled == 3u {
            // A sheet: only the next cell on the point's side has light of that side alone.
            let place = f32((walls >> (6u + 6u * axis)) & 63u) / 63.0;
            keep_above = at[axis] - cell[axis] >= place;
            low = cell[axis] + 1.0;
            high = cell[axis];
        }
        if walled != 0u {
            out[axis] = select(min(out[axis], high), max(out[axis], low), keep_above);
        }
    }
    return out;
}

/// Weights of a tap's three faces: less if a sheet across another axis divides the cell.
fn undivided(walls: u32) -> vec3<f32> {
    let divided = vec3<f32>(
        select(1.0, DIVIDED_WEIGHT, walled_faces(walls, 0u) == 3u),
        select(1.0, DIVIDED_WEIGHT, walled_faces(walls, 1u) == 3u),
        select(1.0, DIVIDED_WEIGHT, walled_faces(walls, 2u) == 3u),
    );
    return min(divided.yzx, divided.zxy);
}

/// Whether a neighbouring cell is in front of the walls of a cell. `offset`: −1, 0 or 1 per axis.
fn is_before_walls(walls: u32, offset: vec3<i32>) -> bool {
    for (var axis = 0u; axis < 3u; axis++) {
        // What is towards − is behind a wall that faces +.
        let barred = walled_faces(walls, axis);
        if (offset[axis] < 0 && (barred & 1u) != 0u) || (offset[axis] > 0 && (barred & 2u) != 0u) {
            return false;
        }
    }
    return true;
}
