// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cones through the picture's depths: `cone::depth_cone` over the pixels that they cross.
//!
//! Bindings: none of its own; it uses the scene seam to find the pixels' surfaces.
#define_import_path lucerna::integrators::depth_openness

#import lucerna::camera::primary_ray::point_at_depth
#import lucerna::cone::cone_set::{drawn_cone_of_set, set_spread}
#import lucerna::cone::depth_cone::{CLEARANCE, DEPTH_STEPS, MIN_RISE, THICKNESS, sphere_openness}
#import lucerna::cone::march::{Cone, cone_point, cone_width}
#import lucerna::frame::view::{picture_from_clip, sampled_point}
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::scene::pixel::{pixel_distance, view}

/// Cones of the hemisphere.
const N_DEPTH_CONES: u32 = 5u;
/// Cones that leave the surface at a slant are followed farther, up to 1 over this, until they are as high as upright
/// ones.
const LEAST_SLANT: f32 = 0.3;

/// How much of a cone is open from its origin to `cone.max_distance` [m].
///
/// `jitter` in [0, 1) shifts the steps.
fn depth_openness(cone: Cone, jitter: f32) -> f32 {
    var open = 1.0;
    let rise = max(dot(cone.normal, cone.direction), 0.05);
    for (var step = 0u; step < DEPTH_STEPS; step++) {
        let share = (f32(step) + mix(0.25, 1.0, jitter)) / f32(DEPTH_STEPS);
        // Steps are shorter near the start.
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
            // The surface there, as seen from the cone's origin: the cone's own plane, seen at a slant, does not hide.
            let there = point_at_depth(view.camera, sampled_point(view, pixel), found) - cone.origin;
            if dot(there, cone.normal) > MIN_RISE * length(there) {
                let thickness = THICKNESS * cone.max_distance;
                open = min(open, sphere_openness(z, radius, found, thickness));
            }
        }
    }
    return open;
}

/// How much of the hemisphere around `shading_normal` is open up to the height `reach` [m] over a surface, weighted by
/// the cosine; 1 if all of it is below the surface. (Cones that a bent normal turns below the surface are already dark
/// in the voxels.)
///
/// Normals: unit length. `stream`, `sample_ix`: those of the random numbers that turn each cone within its part;
/// `jitter` in [0, 1) shifts the steps.
fn hemisphere_openness(
    position: vec3<f32>,
    geometric_normal: vec3<f32>,
    shading_normal: vec3<f32>,
    reach: f32,
    stream: u32,
    sample_ix: u32,
    jitter: f32,
) -> f32 {
    let basis = frame_from_normal(shading_normal);
    let spread = set_spread(N_DEPTH_CONES);
    var sum = 0.0;
    var weights = 0.0;
    for (var ix = 0u; ix < N_DEPTH_CONES; ix++) {
        let member = drawn_cone_of_set(N_DEPTH_CONES, ix, sobol_owen(sample_ix, pcg(stream + ix)));
        let direction = basis * member.direction;
        let rise = dot(direction, geometric_normal);
        if rise > 0.0 {
            let length = reach / max(rise, LEAST_SLANT);
            let cone = Cone(position, spread, direction, length, geometric_normal, 0.0);
            sum += member.weight * depth_openness(cone, jitter);
            weights += member.weight;
        }
    }
    return select(1.0, sum / weights, weights > 0.0);
}

/// How much of one cone along `direction` (unit length) is open up to the height `reach` [m] over a surface; 1 if it
/// leads below the surface. `spread`: tan of half its aperture; `jitter`: as in [`hemisphere_openness`].
fn direction_openness(
    position: vec3<f32>,
    geometric_normal: vec3<f32>,
    direction: vec3<f32>,
    spread: f32,
    reach: f32,
    jitter: f32,
) -> f32 {
    let rise = dot(direction, geometric_normal);
    if rise <= 0.0 {
        return 1.0;
    }
    let length = reach / max(rise, LEAST_SLANT);
    return depth_openness(Cone(position, spread, direction, length, geometric_normal, 0.0), jitter);
}
