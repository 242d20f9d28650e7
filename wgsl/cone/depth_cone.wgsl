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
