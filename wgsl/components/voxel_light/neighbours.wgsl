// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which cells share light with a voxel's face to reduce noise, and how much.
//!
//! Neighbouring faces see nearly the same. A face has 8 neighbouring cells in its plane, a voxel with one value has 26.
//! Along each axis a neighbour has half the weight of the middle cell (a tent): over the 3 × 3 cells of a plane, the
//! variance of the mean of values of equal variance is 9/64 of theirs.
#define_import_path lucerna::components::voxel_light::neighbours

/// With up to this many hits of its own, a face takes all of its neighbours' light.
const SHARING_HITS: f32 = 64.0;

/// Number of cells including the middle one: 9, or 27 around a voxel with one value.
fn n_neighbours(is_isotropic: bool) -> u32 {
    return select(9u, 27u, is_isotropic);
}

/// Cell `ix` < [`n_neighbours`] next to a face along `axis`: −1, 0 or 1 per axis, all 0 for the middle one; along the
/// face's own axis 0 unless isotropic.
fn neighbour_offset(ix: u32, axis: u32, is_isotropic: bool) -> vec3<i32> {
    var offset = vec3<i32>(0);
    offset[(axis + 1u) % 3u] = i32(ix % 3u) - 1;
    offset[(axis + 2u) % 3u] = i32(ix / 3u % 3u) - 1;
    offset[axis] = select(0, i32(ix / 9u) - 1, is_isotropic);
    return offset;
}

/// Weight of a neighbour at `offset` (−1, 0 or 1 per axis): 1 for the middle cell, with a factor of ½ for each axis.
fn tent(offset: vec3<i32>) -> f32 {
    let halves = select(vec3<f32>(1.0), vec3<f32>(0.5), offset != vec3<i32>(0));
    return halves.x * halves.y * halves.z;
}

/// How much of its neighbours' light a face with this many hits (≥ 0) takes, in (0, 1]: its own noise falls with the
/// hits, and so does the neighbours' share.
fn sharing_of_hits(n_hits: f32) -> f32 {
    return SHARING_HITS / max(n_hits, SHARING_HITS);
}
