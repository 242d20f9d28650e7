// SPDX-License-Identifier: MIT OR Apache-2.0
//! On which side of the surfaces in its cell the light of a face's record is, and which records around it are on the
//! same side, so that light is not read through walls, however they stand.
//!
//! A record has a *place*: a point of the air just in front of the surface whose light it holds. Two records of
//! neighbouring cells are on the same side if nothing stands between their places. The bits of *reach* say so for the
//! 27 cells around.
//!
//! If a wall stands across what a face sees, the face has two records, and each has a *border*: the plane of the wall,
//! as seen from its place. The first one is in front of its border; whatever is not is for the *other*.
//!
//! The kernel voxel_light/sides finds all of this by rays.
#define_import_path lucerna::components::voxel_light::sides

#import lucerna::math::octahedral::{direction_from_octahedral, octahedral_from_direction}

/// What is known of a record's side, in two word pairs. All zero: nothing.
struct FaceSide {
    /// For each cell around, bit [`reach_bit`]: whether the record of the same face there is on the same side.
    reach: u32,
    /// The place ([`pack_place`]), or NO_PLACE.
    place: u32,
    /// The border ([`pack_border`]), or NO_BORDER.
    border: u32,
    /// Of a face's first record: 1 + the index of its second one (counted in the level), or 0 if there is none. Of a
    /// second record: the index of the first.
    other: u32,
}

/// The face's only record.
const NO_BORDER: u32 = 0u;
/// Planes are counted from the cell's centre up to this far [cells].
const BORDER_RANGE: f32 = 1.25;
const BORDER_STEPS: f32 = 16382.0;
const NORMAL_STEPS: f32 = 511.0;
/// A point belongs to the side on which it is when moved along its surface's normal by this much [cells], so that the
/// points of the wall itself have sides as well.
const SIDE_OFFSET: f32 = 1e-2;

/// Nothing is known.
const NO_PLACE: u32 = 0u;
/// All 27 cells.
const REACHES_ALL: u32 = 0x7ffffffu;
/// How far a place may be outside its cell [cells].
const PLACE_MARGIN: f32 = 0.125;
/// Steps of a place's coordinates.
const PLACE_STEPS: f32 = 1022.0;

/// A point in or near a cell in one word, 10 bits per axis; never NO_PLACE. `point`: from the cell's corner [cells], in
/// [−PLACE_MARGIN, 1 + PLACE_MARGIN]; clamped.
fn pack_place(point: vec3<f32>) -> u32 {
    let share = clamp((point + PLACE_MARGIN) / (1.0 + 2.0 * PLACE_MARGIN), vec3<f32>(0.0), vec3<f32>(1.0));
    let steps = vec3<u32>(round(share * PLACE_STEPS)) + 1u;
    return steps.x | (steps.y << 10u) | (steps.z << 20u);
}

/// Inverse of [`pack_place`], within 0.0007 cells. `place`: not NO_PLACE.
fn unpack_place(place: u32) -> vec3<f32> {
    let steps = ((vec3<u32>(place) >> vec3<u32>(0u, 10u, 20u)) & vec3<u32>(0x3ffu)) - 1u;
    return vec3<f32>(steps) * ((1.0 + 2.0 * PLACE_MARGIN) / PLACE_STEPS) - PLACE_MARGIN;
}

/// A plane through a cell in one word; never NO_BORDER. `normal`: unit length; `point`: on the plane, from the cell's
/// corner [cells].
fn pack_border(normal: vec3<f32>, point: vec3<f32>) -> u32 {
    let n = vec2<u32>(round((octahedral_from_direction(normal) * 0.5 + 0.5) * NORMAL_STEPS));
    // The offset is that of the plane with the rounded normal.
    let offset = dot(border_normal(n.x | (n.y << 9u)), point - 0.5);
    let share = clamp(offset / BORDER_RANGE * 0.5 + 0.5, 0.0, 1.0);
    return n.x | (n.y << 9u) | ((u32(round(share * BORDER_STEPS)) + 1u) << 18u);
}

/// The unit normal of a border, within 0.5°.
fn border_normal(border: u32) -> vec3<f32> {
    let steps = vec2<f32>(f32(border & 511u), f32((border >> 9u) & 511u));
    return direction_from_octahedral(steps / NORMAL_STEPS * 2.0 - 1.0);
}

/// Whether a point (from the cell's corner [cells], also outside of it) is in front of a border; true without one.
fn is_before_border(border: u32, point: vec3<f32>) -> bool {
    if border == NO_BORDER {
        return true;
    }
    let offset = (f32((border >> 18u) - 1u) / BORDER_STEPS * 2.0 - 1.0) * BORDER_RANGE;
    return dot(border_normal(border), point - 0.5) >= offset;
}

/// The bit of a cell at `offset` (−1, 0 or 1 per axis), 0 to 26; 13 is the middle one.
fn reach_bit(offset: vec3<i32>) -> u32 {
    return u32((offset.z + 1) * 9 + (offset.y + 1) * 3 + offset.x + 1);
}

/// The offset of a bit; inverse of [`reach_bit`].
fn reach_offset(bit: u32) -> vec3<i32> {
    return vec3<i32>(vec3<u32>(bit % 3u, bit / 3u % 3u, bit / 9u)) - 1;
}

/// Whether the record of the cell at `offset` is on the same side; false if it is not a neighbour.
fn is_reached(reach: u32, offset: vec3<i32>) -> bool {
    if any(abs(offset) > vec3<i32>(1)) {
        return false;
    }
    return (reach & (1u << reach_bit(offset))) != 0u;
}
