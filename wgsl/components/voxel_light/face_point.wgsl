// SPDX-License-Identifier: MIT OR Apache-2.0
//! A random point of a voxel's face, and the ray along the face's axis that finds the surface in the cell behind it.
//!
//! Spread evenly over the face, such rays hit a surface with a density of |cos| to the axis (see `cache`). Units:
//! cells, from the grid's corner.
#define_import_path lucerna::components::voxel_light::face_point

#import lucerna::components::voxels::grid::{face_axis, face_normal}

/// Rays along the axis start this far in front of the face and end this far behind the opposite one [cells], because a
/// surface on the border between two cells belongs to both.
const BORDER: f32 = 1e-3;

/// Length of a ray from [`face_point`] through the whole cell [cells].
const FACE_RAY_LENGTH: f32 = 1.0 + 2.0 * BORDER;

/// Where the ray of a face (0 to 5) starts, BORDER before it; it runs against the face's normal. `cell`: its coordinates; `u`: uniform in
/// [0, 1)².
fn face_point(cell: vec3<f32>, face: u32, u: vec2<f32>) -> vec3<f32> {
    let axis = face_axis(face);
    var start = vec3<f32>(0.5);
    start[(axis + 1u) % 3u] = u.x;
    start[(axis + 2u) % 3u] = u.y;
    start += face_normal(face) * (0.5 + BORDER);
    return cell + start;
}

/// How deep below the face a ray of [`face_point`] hit a surface, in [−BORDER, 1 + BORDER] cells. `distance`: length of
/// the ray up to the hit [cells].
fn depth_below_face(distance: f32) -> f32 {
    return distance - BORDER;
}
