// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which cells share light with a voxel's face against noise, and how much.
//!
//! Neighbouring faces see nearly the same. Beside a face lie 8 cells of its plane, around a voxel with one value 26. Along each
//! axis a neighbour weighs half of the middle one (a tent): over the 3 × 3 of a plane, the mean of values of equal variance
//! has 9/64 of it.
#define_import_path lucerna::components::voxel_light::neighbours

/// So many hits of its own a face has when it still takes all of its neighbours' light.
const SHARING_HITS: f32 = 64.0;

/// How many cells there are with the middle one: 9, or 27 around a voxel with one value.
fn n_neighbours(is_isotropic: bool) -> u32 {
    return select(9u, 27u, is_isotropic);
}

/// Cell `ix` < [`n_neighbours`] beside a face that looks along `axis`: −1, 0 or 1 an axis, all 0 for the middle one; along the
/// face's own axis 0 unless isotropic.
fn neighbour_offset(ix: u32, axis: u32, is_isotropic: bool) -> vec3<i32> {
    var offset = vec3<i32>(0);
    offset[(axis + 1u) % 3u] = i32(ix % 3u) - 1;
    offset[(axis + 2u) % 3u] = i32(ix / 3u % 3u) - 1;
    offset[axis] = select(0, i32(ix / 9u) - 1, is_isotropic);
    return offset;
}

/// Weight of a neighbour `offset` away (−1, 0 or 1 an axis), the middle one having 1: along each axis ½.
fn tent(offset: vec3<i32>) -> f32 {
    let halves = select(vec3<f32>(1.0), vec3<f32>(0.5), offset != vec3<i32>(0));
    return halves.x * halves.y * halves.z;
}

/// How much of its neighbours' light a face takes that is itself the mean of so many hits (≥ 0), in (0, 1]: its own noise falls with
/// them, and the neighbours' share with it.
fn sharing_of_hits(n_hits: f32) -> f32 {
    return SHARING_HITS / max(n_hits, SHARING_HITS);
}
