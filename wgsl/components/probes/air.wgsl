// SPDX-License-Identifier: MIT OR Apache-2.0
//! The cells of the air between surfaces: of two strides, middle ones around those that surfaces meet, wide ones everywhere.
//!
//! A corner without a probe takes its light from the corners of the middle cell around it, and a corner of a middle cell that has none from
//! those of the wide cell. So the light is one continuous function over the whole lattice: trilinear in each cell, with what the
//! corners hold, whether that is a probe's or interpolated.
#define_import_path lucerna::components::probes::air

/// Edge of a middle cell [cells].
const MIDDLE_STRIDE: u32 = 2u;
/// Edge of a wide cell [cells].
const WIDE_STRIDE: u32 = 4u;

/// The number of corners of cells of a stride along each axis of a lattice of `size` corners, at least 2.
fn air_size(size: vec3<u32>, stride: u32) -> vec3<u32> {
    return (size - 1u + vec3<u32>(stride - 1u)) / stride + 1u;
}

/// A corner of the cells of a stride: the last ones are on the border, also where the lattice is no multiple.
fn air_corner(ix: vec3<u32>, size: vec3<u32>, stride: u32) -> vec3<u32> {
    return min(ix * stride, size - 1u);
}

/// The least corner of the cell of a stride around a corner.
fn air_below(corner: vec3<u32>, stride: u32) -> vec3<u32> {
    return corner / stride * stride;
}

/// Whether a corner is one of a cell of a stride.
fn is_air_corner(corner: vec3<u32>, size: vec3<u32>, stride: u32) -> bool {
    return all((corner % stride == vec3<u32>(0u)) | (corner == size - 1u));
}
