// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a probe is, relative to its corner of the lattice, and whether it is inside something: one word.
//!
//! Probes that are very near to a surface are moved (after the relocation of Z. Majercik et al., "Scaling
//! Probe-Based Real-Time Dynamic Global Illumination for Production", JCGT 10(2), 2021). The word 0 is a probe at its corner.
#define_import_path lucerna::components::probes::place

/// Parts of a cell in which a move is kept.
const MOVE_STEPS: f32 = 1024.0;
/// A probe moves less than this along each axis [cells].
const MOST_MOVED: f32 = 0.45;
/// Set: the probe is inside something, or behind a wall.
const PLACE_INSIDE: u32 = 0x40000000u;

/// The word of a probe that was moved [cells], each component in ±MOST_MOVED; rounded to 1/MOVE_STEPS.
fn pack_move(moved: vec3<f32>, is_inside: bool) -> u32 {
    let steps = vec3<i32>(round(clamp(moved, vec3<f32>(-MOST_MOVED), vec3<f32>(MOST_MOVED)) * MOVE_STEPS));
    let bits = bitcast<vec3<u32>>(steps) & vec3<u32>(1023u);
    return bits.x | (bits.y << 10u) | (bits.z << 20u) | select(0u, PLACE_INSIDE, is_inside);
}

/// How far a probe was moved from its corner [cells].
fn place_moved(place: u32) -> vec3<f32> {
    // (Two's complement of ten bits: to the top, and back with the sign.)
    let top = vec3<u32>(place << 22u, place << 12u, place << 2u);
    return vec3<f32>(bitcast<vec3<i32>>(top) >> vec3<u32>(22u)) / MOVE_STEPS;
}

/// Whether the probe is inside something, or behind a wall.
fn place_is_inside(place: u32) -> bool {
    return (place & PLACE_INSIDE) != 0u;
}
