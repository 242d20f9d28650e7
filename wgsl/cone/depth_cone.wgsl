// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cones through a picture's depths: what stands close by, finer than any voxel.
//!
//! Spheres along the cone are projected into the picture, and compared with the depth that stands there: the share of a
//! sphere that lies behind that depth is hidden. Only what the camera sees can hide, and nothing tells how thick it is.
//! Screen-space specular occlusion is this along the mirrored direction: it attenuates what a voxel cone, which begins
//! some voxels off the surface, finds.
//!
//! Symbols: z distance along the view axis [m]; `open`: share that nothing hides, in [0, 1].
#define_import_path lucerna::cone::depth_cone

#import lucerna::camera::primary_ray::point_at_depth
#import lucerna::cone::march::{Cone, cone_point, cone_width}
#import lucerna::frame::view::{FrameView, picture_from_clip, sampled_point}

/// Steps of a cone.
const DEPTH_STEPS: u32 = 12u;
/// What stands so many of the cone's lengths before a sphere is something else, far in front.
const THICKNESS: f32 = 1.0;
/// What hides stands so high over the surface, as the sine of an angle (6°).
const MIN_RISE: f32 = 0.1;
/// A sphere is at most this share of its height over the surface, so that the surface does not hide it.
const CLEARANCE: f32 = 0.9;

/// How much of a sphere is open, of a depth `found` [m] in its direction; z, radius: of the sphere [m].
fn sphere_openness(z: f32, radius: f32, found: f32, thickness: f32) -> f32 {
    let hidden = clamp((z + radius - found) / (2.0 * radius), 0.0, 1.0);
    // What stands in front of all that the cone could be behind of does not hide.
    return 1.0 - select(0.0, hidden, found > z - radius - thickness);
}

/// How much of a cone is open from its origin to `cone.max_distance` [m].
///
/// `depths`: reversed, near/z, 0 where nothing is. `jitter` in [0, 1) shifts the steps.
fn depth_openness(view: FrameView, depths: texture_depth_2d, cone: Cone, jitter: f32) -> f32 {
    var open = 1.0;
    let rise = max(dot(cone.normal, cone.direction), 0.05);
    for (var step = 0u; step < DEPTH_STEPS; step++) {
        let share = (f32(step) + mix(0.25, 1.0, jitter)) / f32(DEPTH_STEPS);
        // Close by steps are shorter.
        let t = cone.max_distance * share * share;
        let radius = max(min(0.5 * cone_width(cone, t), CLEARANCE * rise * t), 1e-6);
        let at = cone_point(cone, t);
        let clip = view.clip_from_world * vec4<f32>(at, 1.0);
        let z = dot(at - view.camera.position, view.camera.forward);
        let point = picture_from_clip(clip);
        if !(clip.w > 0.0) || !(z > view.near) || any(point < vec2<f32>(0.0)) || any(point >= vec2<f32>(1.0)) {
            break;
        }
        let pixel = vec2<u32>(point * vec2<f32>(view.size));
        let depth = textureLoad(depths, pixel, 0);
        if depth > 0.0 {
            let found = view.near / depth;
            // What stands there, from the cone's origin: the cone's own plane, seen at a slant, is no hindrance.
            let there = point_at_depth(view.camera, sampled_point(view, pixel), found) - cone.origin;
            if dot(there, cone.normal) > MIN_RISE * length(there) {
                let thickness = THICKNESS * cone.max_distance;
                open = min(open, sphere_openness(z, radius, found, thickness));
            }
        }
    }
    return open;
}
