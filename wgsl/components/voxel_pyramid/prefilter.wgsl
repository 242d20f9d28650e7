// SPDX-License-Identifier: MIT OR Apache-2.0
//! Coarser voxels from finer ones, for one direction of view: C. Crassin et al., "Interactive Indirect
//! Illumination Using Voxel Cone Tracing", 2011 (anisotropic voxels).
//!
//! A parent has 2 × 2 × 2 children: four columns along the axis of view, each of a front and a back child.
//! A column is the front one over the back one; the parent is the mean of the columns.
#define_import_path lucerna::components::voxel_pyramid::prefilter

#import lucerna::cone::medium::{premultiplied, texel_of_premultiplied}

/// `front` over `back`, both premultiplied (rgb: radiance · opacity, a: opacity).
fn over(front: vec4<f32>, back: vec4<f32>) -> vec4<f32> {
    return front + (1.0 - front.a) * back;
}

/// Child `column` (0 to 3), `depth` (0 the front, 1 the back) for a face 0 to 5 (+X −X +Y −Y +Z −Z) from which it is
/// seen: its offset within the parent, 0 or 1 per axis.
fn child_offset(face: u32, column: u32, depth: u32) -> vec3<u32> {
    let axis = face >> 1u;
    var offset = vec3<u32>(0u);
    offset[(axis + 1u) % 3u] = column & 1u;
    offset[(axis + 2u) % 3u] = column >> 1u;
    // From the positive side the front child is the upper one.
    offset[axis] = select(depth, 1u - depth, (face & 1u) == 0u);
    return offset;
}

/// Adds a column of two texels (`medium::texel_of_surface`) to a sum of premultiplied ones.
fn add_column(sum: vec4<f32>, front: vec4<f32>, back: vec4<f32>) -> vec4<f32> {
    return sum + over(premultiplied(front), premultiplied(back));
}

/// The parent's texel, from the sum over its four columns.
fn parent_of_columns(sum: vec4<f32>) -> vec4<f32> {
    return texel_of_premultiplied(0.25 * sum);
}
