// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where walls stand within a voxel, by what rays found of its faces.
//!
//! A face of a voxel is *walled* if a surface that looks its way covers at least half of what is open of it
//! (of a wall that stands on a floor, only the part above the floor shows), and looks along the axis: slanted and
//! vaulted surfaces are no walls in this sense, for nothing tells which part of their cell lies behind. From a
//! point in a cell whose +X face is walled alone, everything towards −X lies behind that wall, and
//! the light of cells there must not be mixed in. Where both faces of an axis are walled, a thin sheet
//! stands within the cell: the point is on one side of it, and what the cell holds for its other
//! faces is a mixture of both sides.
//!
//! What is marked is a voxel's word, which `wall_words` reads.
#define_import_path lucerna::components::voxel_light::walls

#import lucerna::components::voxel_light::cache::{FaceLight, hit_depth, is_lit, wall_coverage}
#import lucerna::components::voxel_light::wall_words::wall_bits

/// Covered that much of what is open, a face is walled.
const MIN_COVERAGE: f32 = 0.5;
/// Thinner than this share of a cell, an open part tells nothing.
const MIN_OPEN_PART: f32 = 0.05;

/// Which share of a cell is open along an axis, in [MIN_OPEN_PART, 1]: above a floor, under which all is dark, only what
/// lies between it and the cell's face; a wall that stands on it can cover no more.
fn open_part(plus: FaceLight, minus: FaceLight) -> f32 {
    let plus_closes = is_lit(plus) && wall_coverage(plus) >= MIN_COVERAGE;
    let minus_closes = is_lit(minus) && wall_coverage(minus) >= MIN_COVERAGE;
    if plus_closes == minus_closes {
        return 1.0;
    }
    return clamp(select(hit_depth(minus), hit_depth(plus), plus_closes), MIN_OPEN_PART, 1.0);
}

/// The word of one axis: `plus`, `minus`: the records of its two faces; `open`: which share of these faces is
/// open, the product of the other axes' [`open_part`]s.
fn walls_of_axis(axis: u32, plus: FaceLight, minus: FaceLight, open: f32) -> u32 {
    let plus_walled = wall_coverage(plus) >= MIN_COVERAGE * open;
    let minus_walled = wall_coverage(minus) >= MIN_COVERAGE * open;
    // Depths count from each face inwards.
    return wall_bits(axis, plus_walled, minus_walled, 0.5 * (1.0 - hit_depth(plus) + hit_depth(minus)));
}
