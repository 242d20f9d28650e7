// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a real-time frame sees, and from where: the uniform that all its kernels share.
//!
//! Spaces: world [m], right-handed; clip, +X right, +Y up; picture, (0, 0) its top left corner, (1, 1)
//! its bottom right. Depth is reversed with an infinite far plane: near/z, 1 on the near plane and 0
//! infinitely far; z is the distance along the view axis. Orthographic cameras have the same depths.
#define_import_path lucerna::frame::view

#import lucerna::camera::primary_ray::{Camera, primary_ray}

/// One frame's camera. Matrices are without the jitter.
struct FrameView {
    camera: Camera,
    /// Perspective: (x, y, near, z) in the camera's axes. Orthographic: z runs linearly from 1 on the near plane to 0
    /// behind the scene, and only clips; depths are still near/z.
    clip_from_world: mat4x4<f32>,
    world_from_clip: mat4x4<f32>,
    /// `clip_from_world` of the previous frame; this frame's own if there was none.
    previous_clip_from_world: mat4x4<f32>,
    /// [pixels]
    size: vec2<u32>,
    /// From the pixel's centre to where this frame samples it, right and down, in [−½, ½) [pixels].
    jitter: vec2<f32>,
    /// Counts frames, for random numbers.
    frame: u32,
    /// Seed of the random numbers.
    seed: u32,
    /// Distance of the near plane [m].
    near: f32,
    /// Share of a pixel's width that a sample represents: 1/√n if n jittered frames are averaged.
    footprint: f32,
    /// 1: every surface is Lambertian with its base colour as albedo.
    lambert: u32,
    /// 1: the first surface is a white Lambertian, so that π·(direct + indirect) is its irradiance.
    irradiance: u32,
    /// Orthographic: 1/(range of z that is not clipped) [m⁻¹].
    inverse_range: f32,
    /// Radius of ambient occlusion [m].
    occlusion_distance: f32,
    /// Factor of the G-buffer's emission, a power of two: the scene's brightest emission fits into 16 bits, and so do
    /// emissions 2²⁸ times weaker.
    emission_scale: f32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

/// Motion of points that were behind the camera in the previous frame; no other point moves this far.
const NOT_IN_PICTURE: f32 = 4.0;

/// Where in the picture this frame samples a pixel.
fn sampled_point(view: FrameView, pixel: vec2<u32>) -> vec2<f32> {
    return (vec2<f32>(pixel) + (0.5 + view.jitter)) / vec2<f32>(view.size);
}

/// Unit vector of the pixel's direction of view, away from the camera.
fn view_direction(view: FrameView, pixel: vec2<u32>) -> vec3<f32> {
    return primary_ray(view.camera, sampled_point(view, pixel)).direction;
}

/// Clip-space position for the rasteriser, jitter included.
///
/// Computed with the camera's axes, not with the matrix: the difference from the camera is taken first, so that
/// coordinates far from the origin lose no precision.
fn clip_position(view: FrameView, position: vec3<f32>) -> vec4<f32> {
    let camera = view.camera;
    let offset = position - camera.position;
    let z = dot(offset, camera.forward);
    let plane = vec2<f32>(
        dot(offset, camera.right) / dot(camera.right, camera.right),
        dot(offset, camera.up) / dot(camera.up, camera.up),
    );
    // The centre of a pixel must see what is `jitter` away from it.
    let shift = vec2<f32>(-2.0, 2.0) * view.jitter / vec2<f32>(view.size);
    if camera.orthographic != 0u {
        return vec4<f32>(plane + shift, 1.0 - (z - view.near) * view.inverse_range, 1.0);
    }
    return vec4<f32>(plane + shift * z, view.near, z);
}

/// Point of the picture of a clip-space position; w > 0.
fn picture_from_clip(clip: vec4<f32>) -> vec2<f32> {
    return vec2<f32>(0.5, -0.5) * (clip.xy / clip.w) + 0.5;
}

/// Where the point was in the previous frame, minus `point`, where it is now (both in the picture). [`NOT_IN_PICTURE`]
/// if it was behind the camera.
fn motion_at(view: FrameView, position: vec3<f32>, point: vec2<f32>) -> vec2<f32> {
    let previous = view.previous_clip_from_world * vec4<f32>(position, 1.0);
    if !(previous.w > 0.0) {
        return vec2<f32>(NOT_IN_PICTURE);
    }
    return clamp(picture_from_clip(previous) - point, vec2<f32>(-NOT_IN_PICTURE), vec2<f32>(NOT_IN_PICTURE));
}
