// SPDX-License-Identifier: MIT OR Apache-2.0
//! The scene's camera as the kernels read it.

use crate::bindings::lucerna::camera::primary_ray as wgsl;
use crate::scene::{Camera, Projection};
use glam::UVec2;

/// The camera for a picture of this size: the vertical field of view is the camera's, the
/// horizontal one follows the picture's shape.
pub fn camera_for_size(camera: &Camera, size: UVec2) -> wgsl::Camera {
    let (half_height, orthographic) = match camera.projection {
        Projection::Perspective { vertical_fov } => ((0.5 * vertical_fov).tan(), 0),
        Projection::Orthographic { half_height } => (half_height, 1),
    };
    let aspect = size.x as f32 / size.y as f32;
    let right = camera.forward.cross(camera.up).normalize_or_zero();
    wgsl::Camera {
        position: camera.position,
        orthographic,
        forward: camera.forward,
        reserved_a: 0,
        right: right * half_height * aspect,
        reserved_b: 0,
        up: right.cross(camera.forward) * half_height,
        reserved_c: 0,
    }
}
