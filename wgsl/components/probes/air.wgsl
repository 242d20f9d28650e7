// SPDX-License-Identifier: MIT OR Apache-2.0
//! The wide cells of the air between surfaces: every AIR_STRIDE-th corner of the lattice has a probe, whatever is near it.
//!
//! A corner without a probe takes its light from the corners of the wide cell around it. So the light is one continuous function over
//! the whole lattice: trilinear in each cell, with what the corners hold, whether that is a probe's or interpolated.
#define_import_path lucerna::components::probes::air

/// Edge of a wide cell [cells].
const AIR_STRIDE: u32 = 4u;

/// The number of wide cells' corners along each axis of a lattice of `size` corners, at least 2.
fn air_size(size: vec3<u32>) -> vec3<u32> {
    return (size - 1u + vec3<u32>(AIR_STRIDE - 1u)) / AIR_STRIDE + 1u;
}

/// The corner of a wide cell's corner: the last ones are on the border, also where the lattice is no multiple.
fn air_corner(ix: vec3<u32>, size: vec3<u32>) -> vec3<u32> {
    return min(ix * AIR_STRIDE, size - 1u);
}

/// The least corner of the wide cell around a corner.
fn air_below(corner: vec3<u32>) -> vec3<u32> {
    return corner / AIR_STRIDE * AIR_STRIDE;
}
