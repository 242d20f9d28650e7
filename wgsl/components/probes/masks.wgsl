// SPDX-License-Identifier: MIT OR Apache-2.0
//! Masks of what a probe sees of a cell: a bit for each of its 4 × 4 × 4 subvolumes.
//!
//! Light-probe volumes (2016), section 3.1.2.1: paths lead from the subvolume at the probe's corner to those of the opposite three faces. A
//! subvolume ends its paths if more of the surfaces in it face away from the probe than towards it.
#define_import_path lucerna::components::probes::masks

/// Subvolumes along each axis of a cell.
const MASK_SIDE: u32 = 4u;
/// Subvolumes of a cell.
const MASK_BITS: u32 = 64u;
/// Words of a cell: two for each of its corners.
const MASK_WORDS: u32 = 16u;
/// Sums of areas in a subvolume: all, and what faces each of the eight corners.
const MASK_SUMS: u32 = 9u;
/// An area of one face of a subvolume, as a number.
const MASK_AREA: f32 = 65536.0;

/// The voxels whose areas are added up at once.
struct MaskRange {
    first: u32,
    n: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// The bit of a subvolume, x fastest.
fn mask_bit(subvolume: vec3<u32>) -> u32 {
    return (subvolume.z * MASK_SIDE + subvolume.y) * MASK_SIDE + subvolume.x;
}

/// Whether a mask has a bit.
fn mask_has(mask: vec2<u32>, bit: u32) -> bool {
    return ((select(mask.x, mask.y, bit >= 32u) >> (bit & 31u)) & 1u) != 0u;
}

/// A mask with one more bit.
fn mask_with(mask: vec2<u32>, bit: u32) -> vec2<u32> {
    let one = 1u << (bit & 31u);
    return mask | select(vec2<u32>(one, 0u), vec2<u32>(0u, one), bit >= 32u);
}

/// An area [faces of a subvolume] as a number, at least 1: what touches a subvolume is in it.
fn mask_area(area: f32) -> u32 {
    return max(u32(area * MASK_AREA + 0.5), 1u);
}

/// Whether a surface faces a corner (0 to 7, x lowest), as seen from the middle of the cell.
fn faces_corner(normal: vec3<f32>, corner: u32) -> bool {
    let is_upper = ((vec3<u32>(corner) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) != vec3<u32>(0u);
    return dot(normal, select(vec3<f32>(-1.0), vec3<f32>(1.0), is_upper)) > 0.0;
}

/// Whether paths go on through a subvolume: it is empty, or more than half of the area in it faces the probe.
fn is_open(area: u32, facing: u32) -> bool {
    return area == 0u || facing > area - facing;
}

/// What the probe at a corner (0 to 7) sees of a cell whose open subvolumes are `open`.
///
/// A path goes to the neighbour that is nearest to its goal, counted in subvolumes, and to all of them if several are: so to each neighbour
/// that is one step nearer along an axis. Over all goals on the opposite faces, a subvolume is reached if one of those before it, towards
/// the corner, is seen.
fn seen_mask(open: vec2<u32>, corner: u32) -> vec2<u32> {
    let flip = ((vec3<u32>(corner) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u)) * (MASK_SIDE - 1u);
    var seen = vec2<u32>(0u);
    for (var ix = 0u; ix < MASK_BITS; ix++) {
        // As seen from the corner; 3 − x is 3 XOR x.
        let away = vec3<u32>(ix, ix / MASK_SIDE, ix / (MASK_SIDE * MASK_SIDE)) % MASK_SIDE;
        var is_reached = ix == 0u;
        for (var axis = 0u; axis < 3u; axis++) {
            if away[axis] > 0u {
                var before = away;
                before[axis] -= 1u;
                is_reached |= mask_has(seen, mask_bit(before ^ flip));
            }
        }
        let bit = mask_bit(away ^ flip);
        if is_reached && mask_has(open, bit) {
            seen = mask_with(seen, bit);
        }
    }
    return seen;
}
