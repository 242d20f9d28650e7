// SPDX-License-Identifier: MIT OR Apache-2.0
//! Rays from the camera through the picture.
#define_import_path lucerna::camera::primary_ray

#import lucerna::math::vector::safe_normalize

/// A pinhole or orthographic camera. The picture's plane is spanned by `right` and `up`.
struct Camera {
    /// [m]
    position: vec3<f32>,
    /// 1: parallel rays.
    orthographic: u32,
    /// Unit length.
    forward: vec3<f32>,
    reserved_a: u32,
    /// To the picture's right edge: half its width at distance 1, or, for parallel rays, half its
    /// width [m].
    right: vec3<f32>,
    reserved_b: u32,
    /// To the picture's upper edge, in the same way.
    up: vec3<f32>,
    reserved_c: u32,
}

/// Start and direction of a ray.
struct PrimaryRay {
    origin: vec3<f32>,
    /// Unit length.
    direction: vec3<f32>,
}

/// The ray through a point of the picture; (0, 0) is its top left corner, (1, 1) its bottom right.
fn primary_ray(camera: Camera, point: vec2<f32>) -> PrimaryRay {
    let offset = camera.right * (2.0 * point.x - 1.0) + camera.up * (1.0 - 2.0 * point.y);
    if camera.orthographic != 0u {
        return PrimaryRay(camera.position + offset, camera.forward);
    }
    return PrimaryRay(camera.position, safe_normalize(camera.forward + offset, camera.forward));
}

/// The point of the picture (as in [`primary_ray`]) at this distance along the view axis [m].
fn point_at_depth(camera: Camera, point: vec2<f32>, depth: f32) -> vec3<f32> {
    let offset = camera.right * (2.0 * point.x - 1.0) + camera.up * (1.0 - 2.0 * point.y);
    if camera.orthographic != 0u {
        return camera.position + (offset + camera.forward * depth);
    }
    return camera.position + (camera.forward + offset) * depth;
}
