// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where walls are within a voxel, from what rays found at its faces.
//!
//! A face of a voxel is *walled* if a surface that faces its way covers at least half of its open part (of a wall on a
//! floor, only the part above the floor is visible), and faces along the axis. Slanted and vaulted surfaces are not
//! walls in this sense, because it is not known which part of their cell is behind them. If only the +X face of a cell
//! is walled, then for a point in it everything towards −X is behind that wall, and the light of cells there must not
//! be mixed in. If both faces of an axis are walled, there is a thin sheet within the cell: the point is on one side of
//! it, and what the cell stores for its other faces is a mixture of both sides.
//!
//! The result is a voxel's word, which `wall_words` reads.
#define_import_path lucerna::components::voxel_light::walls

#import lucerna::components::voxel_light::cache::{FaceLight, hit_depth, is_lit, wall_coverage}
#import lucerna::components::voxel_light::wall_words::wall_bits

/// A face is walled if at least this share of its open part is covered.
const MIN_COVERAGE: f32 = 0.5;
/// An open part smaller than this share of a cell says nothing.
const MIN_OPEN_PART: f32 = 0.05;

/// Which share of a cell is open along an axis, in [MIN_OPEN_PART, 1]: above a floor, under which everything is dark,
/// only the part between the floor and the cell's face; a wall on the floor cannot cover more.
fn open_part(plus: FaceLight, minus: FaceLight) -> f32 {
    let plus_closes = is_lit(plus) && wall_coverage(plus) >= MIN_COVERAGE;
    let minus_closes = is_lit(minus) && wall_coverage(minus) >= MIN_COVERAGE;
    if plus_closes == minus_closes {
        return 1.0;
    }
    return clamp(select(hit_depth(minus), hit_depth(plus), plus_closes), MIN_OPEN_PART, 1.0);
}

/// The word of one axis. `plus`, `minus`: the records of its two faces; `open`: the open share of these faces, the
/// product of the other axes' [`open_part`]s.
fn walls_of_axis(axis: u32, plus: FaceLight, minus: FaceLight, open: f32) -> u32 {
    let plus_walled = wall_coverage(plus) >= MIN_COVERAGE * open;
    let minus_walled = wall_coverage(minus) >= MIN_COVERAGE * open;
    // Depths count from each face inwards.
    return wall_bits(axis, plus_walled, minus_walled, 0.5 * (1.0 - hit_depth(plus) + hit_depth(minus)));
}
