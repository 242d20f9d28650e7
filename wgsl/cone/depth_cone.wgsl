// SPDX-License-Identifier: MIT OR Apache-2.0
//! Cones through a picture's depths, for occlusion close by, finer than any voxel.
//!
//! Spheres along the cone are projected into the picture, and compared with the depth there: the share of a sphere
//! behind that depth is hidden. Only what the camera sees can hide, and its thickness is not known. Screen-space
//! specular occlusion is this along the mirrored direction: it attenuates what a voxel cone, which starts some voxels
//! off the surface, finds.
//!
//! Symbols: z distance along the view axis [m]; `open`: share that is not hidden, in [0, 1].
#define_import_path lucerna::cone::depth_cone

/// Steps of a cone.
const DEPTH_STEPS: u32 = 12u;
/// What is more than this many lengths of the cone in front of a sphere is a separate object, and does not hide it.
const THICKNESS: f32 = 1.0;
/// What hides must be at least this high above the surface, as the sine of an angle (6°).
const MIN_RISE: f32 = 0.1;
/// A sphere's radius is at most this share of its height above the surface, so that the surface does not hide it.
const CLEARANCE: f32 = 0.9;

/// How much of a sphere is open, given a depth `found` [m] in its direction; z, radius: those of the sphere [m].
fn sphere_openness(z: f32, radius: f32, found: f32, thickness: f32) -> f32 {
    let hidden = clamp((z + radius - found) / (2.0 * radius), 0.0, 1.0);
    // What is in front of everything that the cone could be behind does not hide it.
    return 1.0 - select(0.0, hidden, found > z - radius - thickness);
}
