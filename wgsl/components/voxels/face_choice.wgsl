// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which of a voxel's faces gets a value that belongs to a direction.
//!
//! The faces along the three axes share the value with weights n_x², n_y², n_z² (they sum to 1: the
//! weights of Valve's ambient cube, J. McTaggart, "Half-Life 2 / Valve Source Shading", GDC 2004).
//! One face is chosen with its weight as probability, which takes one write instead of three: the
//! mean of a face converges to the mean weighted by n².
#define_import_path lucerna::components::voxels::face_choice

#import lucerna::components::voxels::grid::faces_of_direction

/// The face, 0 to 5. `normal`: unit length. `u`: uniform in [0, 1).
///
/// For a normal along an axis, this is always that axis's face.
fn choose_face(normal: vec3<f32>, u: f32) -> u32 {
    let faces = faces_of_direction(normal);
    let weights = normal * normal;
    let at = u * (weights.x + weights.y + weights.z);
    if at < weights.x {
        return faces.x;
    }
    if at < weights.x + weights.y || weights.z == 0.0 {
        return select(faces.y, faces.x, weights.y == 0.0);
    }
    return faces.z;
}
