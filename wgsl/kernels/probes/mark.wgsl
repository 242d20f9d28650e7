// SPDX-License-Identifier: MIT OR Apache-2.0
//! Marks the corners of the cells that surfaces meet, and those of the middle cells of the air around them: there will be probes.
//!
//! Or only those of middle cells, at first; and then those of cells where light between the corners of middle cells is not what a straight line
//! between them is: by its second differences, of which interpolation is off by an eighth.
//!
//! Dispatch: indirect, one invocation a voxel, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none. The result
//! does not depend on the order: bits are only set.

#import lucerna::color::luminance::luminance
#import lucerna::components::probes::air::{MIDDLE_STRIDE, air_corner, air_size}
#import lucerna::components::probes::gathered::{BATCH, COEFFICIENTS}
#import lucerna::components::probes::place::place_is_inside
#import lucerna::components::voxels::bricks::{NO_SLOT, bit_of_cell, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::{VoxelGrid, unpack_cell}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;
/// Which cells get corners of their own: none, or by light. Any other number: all.
const MARK_NONE: u32 = 1u;
const MARK_BY_LIGHT: u32 = 2u;
/// Darker than this share of the brightest corner nearby, differences do not count.
const LEAST_SHARE: f32 = 0.02;

/// Differences below this many standard deviations may be noise.
const SURE: f32 = 3.0;

struct MarkInfo {
    /// A MARK_ constant.
    which: u32,
    /// Interpolated light may be off by this share.
    most: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(5) var<uniform> info: MarkInfo;
/// Of the lattice, with probes at the corners of middle cells that have gathered light (MARK_BY_LIGHT).
@group(1) @binding(6) var<storage, read> known: array<vec2<u32>>;
/// See `lucerna::components::probes::gathered`.
@group(1) @binding(7) var<storage, read> gathered: array<vec4<f32>>;

/// Of the cells.
@group(1) @binding(0) var<uniform> grid: VoxelGrid;
/// Of their corners: one more along each axis.
@group(1) @binding(1) var<uniform> lattice: VoxelGrid;
/// x: occupied voxels.
@group(1) @binding(2) var<storage, read> counts: vec4<u32>;
/// Of the cells (`lucerna::components::voxels::bricks`).
@group(1) @binding(3) var<storage, read> structure: array<vec2<u32>>;
/// A word for each brick of the lattice.
@group(1) @binding(4) var<storage, read_write> bits: array<atomic<u32>>;

/// What the probe at a corner of middle cells knows of its light.
struct KnownLight {
    /// Luminance of the constant; below 0: there is no probe, or it is inside something.
    light: f32,
    /// Of its mean, by its batches of paths.
    variance: f32,
}

/// The light at a corner of middle cells.
fn middle_light(at: vec3<i32>) -> KnownLight {
    let size = vec3<i32>(air_size(lattice.size, MIDDLE_STRIDE));
    if any(at < vec3<i32>(0)) || any(at >= size) {
        return KnownLight(-1.0, 0.0);
    }
    let corner = air_corner(vec3<u32>(at), lattice.size, MIDDLE_STRIDE);
    let slot = slot_in_brick(known[brick_of_cell(lattice, corner)], corner);
    if slot == NO_SLOT {
        return KnownLight(-1.0, 0.0);
    }
    let place = known[lattice.bricks.x * lattice.bricks.y * lattice.bricks.z + slot].y;
    let base = slot * COEFFICIENTS;
    let n = gathered[base].a / BATCH;
    let variance = gathered[base + 2u].a / max((n - 1.0) * n, 1.0);
    let light = max(luminance(gathered[base].rgb), 0.0);
    return KnownLight(select(light, -1.0, place_is_inside(place)), variance);
}

/// Whether light in a middle cell is not as straight as it may be: by the second differences at its corners, if they are more than noise.
fn is_curved(middle: vec3<i32>) -> bool {
    var is_too_far = false;
    for (var ix = 0u; ix < 8u; ix++) {
        let at = middle + vec3<i32>((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u));
        let own = middle_light(at);
        if own.light < 0.0 {
            continue;
        }
        for (var axis = 0u; axis < 3u; axis++) {
            var step = vec3<i32>(0);
            step[axis] = 1;
            let before = middle_light(at - step);
            let after = middle_light(at + step);
            if before.light >= 0.0 && after.light >= 0.0 {
                let difference = abs(before.light - 2.0 * own.light + after.light);
                let noise = sqrt(before.variance + 4.0 * own.variance + after.variance);
                let around = max(own.light, max(before.light, after.light));
                let is_far = difference > 8.0 * info.most * max(own.light, LEAST_SHARE * around);
                is_too_far |= is_far && difference > SURE * noise;
            }
        }
    }
    return is_too_far;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let slot = group_of_dispatch(group) * WORKGROUP + local;
    if slot >= counts.x {
        return;
    }
    let cell = unpack_cell(structure[grid.bricks.x * grid.bricks.y * grid.bricks.z + slot].x);
    var is_divided = info.which != MARK_NONE;
    if info.which == MARK_BY_LIGHT {
        is_divided = is_curved(vec3<i32>(cell / MIDDLE_STRIDE));
    }
    for (var ix = 0u; ix < 8u && is_divided; ix++) {
        let corner = cell + ((vec3<u32>(ix) >> vec3<u32>(0u, 1u, 2u)) & vec3<u32>(1u));
        atomicOr(&bits[brick_of_cell(lattice, corner)], 1u << bit_of_cell(corner));
    }
    // The 64 corners of the middle cell around it and of its 26 neighbours; of a cell that is not divided, the eight of the middle cell alone.
    let middle = vec3<i32>(cell / MIDDLE_STRIDE);
    let last = vec3<i32>(air_size(lattice.size, MIDDLE_STRIDE)) - 1;
    for (var ix = 0u; ix < 64u; ix++) {
        let step = vec3<i32>((vec3<u32>(ix) >> vec3<u32>(0u, 2u, 4u)) & vec3<u32>(3u));
        let at = middle - 1 + step;
        if info.which == MARK_BY_LIGHT && !is_divided && (any(step < vec3<i32>(1)) || any(step > vec3<i32>(2))) {
            continue;
        }
        if all(at >= vec3<i32>(0)) && all(at <= last) {
            let corner = air_corner(vec3<u32>(at), lattice.size, MIDDLE_STRIDE);
            atomicOr(&bits[brick_of_cell(lattice, corner)], 1u << bit_of_cell(corner));
        }
    }
}
