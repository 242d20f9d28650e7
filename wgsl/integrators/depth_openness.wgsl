// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cone through the picture's depths: `cone::depth_cone` over the pixels that it crosses.
//!
//! Bindings: none of its own; it asks the scene seam what pixels see.
#define_import_path lucerna::integrators::depth_openness

#import lucerna::camera::primary_ray::point_at_depth
#import lucerna::cone::depth_cone::{CLEARANCE, DEPTH_STEPS, MIN_RISE, THICKNESS, sphere_openness}
#import lucerna::cone::march::{Cone, cone_point, cone_width}
#import lucerna::frame::view::{picture_from_clip, sampled_point}
#import lucerna::scene::pixel::{pixel_distance, view}

/// How much of a cone is open from its origin to `cone.max_distance` [m].
///
/// `jitter` in [0, 1) shifts the steps.
fn depth_openness(cone: Cone, jitter: f32) -> f32 {
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
        let found = pixel_distance(pixel);
        if found > 0.0 {
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
