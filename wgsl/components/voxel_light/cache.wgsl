// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance that is stored for the faces of voxels, and how it is updated.
//!
//! A face of an occupied voxel stores the mean irradiance of the surface points in the cell that rays along the face's
//! axis, from outside, hit first and that are not enclosed (see the kernel voxel_light/gather). Such rays, spread
//! evenly over the face, hit a surface with a density of |cos| to the axis: the mean weights each piece of surface by
//! its area and max(dot(face normal, surface normal), 0), like the anisotropic voxels that T. Magalhães, "Real-Time Ray
//! Traced Voxel Global Illumination", University of Porto, 2020, names as future work.
//!
//! * *direct*: irradiance straight from lights, emissive surfaces and the sky [W·m⁻²]
//! * *indirect*: irradiance that was reflected at least once [W·m⁻²]
//!
//! Indirect light is stored twice. Bounces read what the cache held in the previous frame, so their mean over all
//! frames would feed back into itself: with albedo ρ its error falls like n^−(1−ρ), at ρ = 0.95 practically never. So
//! bounces read only what the newest hits found (`feedback`). Its error falls by the factor ρ per frame, and its noise
//! enters linearly, so that the mean is right. Pictures show its mean over many frames (`indirect`).
//!
//! Neighbouring faces see nearly the same, so they share what they found: always for bounces, and for pictures as long
//! as they have few hits (`neighbours`).
#define_import_path lucerna::components::voxel_light::cache

/// A face's record. All zero: the face has no data yet.
struct FaceLight {
    /// Mean over the hits [W·m⁻²].
    direct: vec3<f32>,
    /// Number of rays along the axis that hit a surface, each weighted by its age.
    n_hits: f32,
    /// Mean over the hits, in which newer ones have more weight [W·m⁻²].
    indirect: vec3<f32>,
    /// Number of rays along the axis, weighted like the hits.
    n_rays: f32,
    /// The same light as `indirect`, but only of the newest frame with a hit [W·m⁻²].
    feedback: vec3<f32>,
    /// From the lowest bit: 8 of the hits' mean depth below the face [cells/255]; 8 unused; 14 of the number of frames in
    /// which something was deposited; CUT_BIT, REJECTED_BIT.
    state: u32,
}

/// Set if a sample of the newest frame was not finite and was left out.
const REJECTED_BIT: u32 = 0x80000000u;
/// Set if samples of the newest frame are missing because the driver ended loops early (`math::loops`).
const CUT_BIT: u32 = 0x40000000u;
/// Lowest bit of the count of deposits.
const DEPOSITS_SHIFT: u32 = 16u;
const DEPOSITS_MAX: u32 = 0x3fffu;
const DEPOSITS_MASK: u32 = DEPOSITS_MAX << DEPOSITS_SHIFT;
/// The newest of n hits has the share RECENCY/n of `indirect`, so that the weight of hit k is about k^(RECENCY − 1):
/// hits from before the light was in balance fade, and 3/4 of the samples' value is kept.
const RECENCY: f32 = 2.0;

/// Once the light has settled (`components::voxels::levels`), faces that sample only direct light do it in one of this many frames.
const SETTLED_PERIOD: u32 = 4u;

/// The samples that one frame adds to a record, as sums over its hits.
struct FaceSamples {
    direct: vec3<f32>,
    n_hits: f32,
    indirect: vec3<f32>,
    n_rays: f32,
    /// Sum of the hits' depths below the face [cells].
    depth: f32,
    /// Number of samples that were not finite; their hits count as dark.
    n_rejected: u32,
}

/// Numbers of faces whose light is wrong, summed over all frames.
struct FaceFaults {
    /// Faces with samples that were not finite.
    n_rejected: atomic<u32>,
    /// Faces with missing samples or cones, because the driver ended loops early (`math::loops`).
    n_cut: atomic<u32>,
}

/// Whether the newest frame's samples were not all finite.
fn has_rejected(light: FaceLight) -> bool {
    return (light.state & REJECTED_BIT) != 0u;
}

/// Whether samples of the newest frame are missing.
fn has_cut(light: FaceLight) -> bool {
    return (light.state & CUT_BIT) != 0u;
}

/// The record, marked as missing samples of the newest frame.
fn with_cut(light: FaceLight) -> FaceLight {
    var out = light;
    out.state |= CUT_BIT;
    return out;
}

/// The record without the marks of the newest frame's missing samples.
fn without_rejection(light: FaceLight) -> FaceLight {
    var out = light;
    out.state &= ~(REJECTED_BIT | CUT_BIT);
    return out;
}

/// Mean depth of the surface below the face, in [0, 1] cells. (In steps of 1/255: once there are so many hits that the
/// mean changes by less, it stays.)
fn hit_depth(light: FaceLight) -> f32 {
    return unpack4x8unorm(light.state).x;
}

/// The record with a frame's samples added.
///
/// `max_rays` ≥ 1: beyond this number the oldest rays fade, so that the record follows slow changes. `light_rays`, at
/// least the frame's own: how many of the face's rays saw the light as it is now; older ones still describe the
/// geometry in the cell, but their light is forgotten. The weights of each mean sum to 1, so no energy is gained or
/// lost.
fn renew(before: FaceLight, samples: FaceSamples, light_rays: f32, max_rays: f32) -> FaceLight {
    let room = max(max_rays - samples.n_rays, 0.0);
    let fade = select(1.0, room / before.n_rays, before.n_rays > room);
    let old_hits = fade * before.n_hits;
    var after: FaceLight;
    after.n_hits = old_hits + samples.n_hits;
    after.n_rays = fade * before.n_rays + samples.n_rays;
    if !(after.n_hits > 0.0) {
        return after;
    }
    let depth = (hit_depth(before) * old_hits + samples.depth) / after.n_hits;
    after.state = pack4x8unorm(vec4<f32>(depth, 0.0, 0.0, 0.0))
        | select(0u, REJECTED_BIT, samples.n_rejected > 0u);
    if samples.n_hits == 0.0 {
        // Without a hit in this frame, the light stays.
        after.direct = before.direct;
        after.indirect = before.indirect;
        after.feedback = before.feedback;
        return after;
    }
    // About this many of the face's hits, including this frame's, saw the light as it is now.
    let light_hits = max(after.n_hits * min(light_rays / after.n_rays, 1.0), samples.n_hits);
    let share = select(samples.n_hits / light_hits, 1.0, old_hits == 0.0);
    let direct = samples.direct / samples.n_hits;
    let indirect = samples.indirect / samples.n_hits;
    // (`mix` by 1 may not give the second value if the first one is huge.)
    after.direct = before.direct * (1.0 - share) + direct * share;
    let recent = min(RECENCY * share, 1.0);
    after.indirect = before.indirect * (1.0 - recent) + indirect * recent;
    after.feedback = indirect;
    return after;
}

/// Number of frames in which something was deposited.
fn n_deposits(light: FaceLight) -> u32 {
    return (light.state >> DEPOSITS_SHIFT) & DEPOSITS_MAX;
}

/// A record as [`renew`] returns it, with the deposits of another: its direct light, which its own rays did not find.
///
/// `light`: without deposits. (They are added instead of replaced: the lavapipe of Mesa 25.0 loses them where
/// `light.state & ~DEPOSITS_MASK` follows the packing in `renew`.)
fn keep_deposits(light: FaceLight, before: FaceLight) -> FaceLight {
    var out = light;
    out.direct = before.direct;
    out.state = light.state | (before.state & DEPOSITS_MASK);
    return out;
}

/// The record with what rays from elsewhere deposited in one frame; `direct` is the mean over the frames in which
/// something was deposited.
///
/// `mean`: rgb irradiance [W·m⁻²], a: number of samples. `light_frames` ≥ 1: how many frames, including this one, saw
/// the light as it is now. What is older is forgotten, and a face without deposits since then is dark.
fn add_deposit(before: FaceLight, mean: vec4<f32>, light_frames: u32) -> FaceLight {
    let n_known = min(n_deposits(before), min(light_frames - 1u, DEPOSITS_MAX - 1u));
    let n_new = select(0u, 1u, mean.a > 0.0);
    let known = select(before.direct, vec3<f32>(0.0), n_known == 0u);
    var after = before;
    after.direct = known + (mean.rgb - known) * (f32(n_new) / f32(max(n_known + n_new, 1u)));
    after.state = (before.state & ~DEPOSITS_MASK) | ((n_known + n_new) << DEPOSITS_SHIFT);
    return after;
}

/// How much of the face a surface covers, in [0, 1]: the share of rays that hit one.
fn coverage(light: FaceLight) -> f32 {
    return select(0.0, min(light.n_hits / light.n_rays, 1.0), light.n_rays > 0.0);
}

/// How many of a face's hits saw the light as it is now, if `light_rays` of its rays did.
fn current_hits(light: FaceLight, light_rays: f32) -> f32 {
    return light.n_hits * min(light_rays / max(light.n_rays, 1.0), 1.0);
}

/// Whether light has been found on the face.
fn is_lit(light: FaceLight) -> bool {
    return any(light.direct + light.indirect > vec3<f32>(0.0));
}
