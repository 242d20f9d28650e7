// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance that is kept for the faces of voxels, and how it is renewed.
//!
//! A face of an occupied voxel keeps the mean irradiance of those surface points in the cell that
//! are met first by rays along the face's axis, from outside, and are not shut in (see the kernel
//! voxel_light/gather). Such rays, spread evenly over the
//! face, meet a surface with a density of |cos| to the axis: the mean weighs each piece of surface
//! by its area and max(dot(face normal, surface normal), 0), as the
//! anisotropic voxels that T. Magalhães, "Real-Time Ray Traced Voxel Global Illumination", University
//! of Porto, 2020, names as future work.
//!
//! * *direct*: irradiance straight from lights, emissive surfaces and the sky [W·m⁻²]
//! * *indirect*: irradiance that was reflected at least once [W·m⁻²]
//!
//! Indirect light is kept twice. Bounces read what the cache held in the frame before, and so their mean
//! over all frames would feed itself: with albedo ρ its error falls like n^−(1−ρ), at ρ = 0.95 practically
//! never. So bounces read what the newest hits alone found (`feedback`), whose error falls by the factor ρ
//! a frame and whose noise, entering linearly, has the right mean; and the long mean of it (`indirect`) is
//! what pictures show.
//!
//! Neighbouring faces see nearly the same, and share what they found: always for bounces, and for
//! pictures as long as they know little (`neighbours`).
#define_import_path lucerna::components::voxel_light::cache

/// A face's record. All zero: nothing is known.
struct FaceLight {
    /// Mean over the hits [W·m⁻²].
    direct: vec3<f32>,
    /// Rays along the axis that met a surface, each weighed by its age.
    n_hits: f32,
    /// Mean over the hits, the newer ones weighing more [W·m⁻²].
    indirect: vec3<f32>,
    /// Rays along the axis, weighed like the hits.
    n_rays: f32,
    /// The same light as `indirect`, of the newest frame with a hit alone [W·m⁻²].
    feedback: vec3<f32>,
    /// From the lowest bit: 8 of the hits' mean depth below the face [cells/255]; 8 of the share of hits on
    /// walls [1/255]; 14 of in how many frames something was deposited; CUT_BIT, REJECTED_BIT.
    state: u32,
}

/// Set if a sample of the newest frame was not finite and was left out.
const REJECTED_BIT: u32 = 0x80000000u;
/// Set if samples of the newest frame are missing because the driver ended loops early (`math::loops`).
const CUT_BIT: u32 = 0x40000000u;
/// A surface whose normal is within 25° of a face's axis stands like a wall to it.
const WALL_COSINE: f32 = 0.9;
/// Where the count of deposits stands.
const DEPOSITS_SHIFT: u32 = 16u;
const DEPOSITS_MAX: u32 = 0x3fffu;
const DEPOSITS_MASK: u32 = DEPOSITS_MAX << DEPOSITS_SHIFT;
/// The newest of n hits has RECENCY/n of `indirect`, so that hit k weighs about k^(RECENCY − 1): what was
/// learned before the light was in balance fades, and 3/4 of the samples' worth is kept.
const RECENCY: f32 = 2.0;

/// What one frame adds to a record: sums over its hits.
struct FaceSamples {
    direct: vec3<f32>,
    n_hits: f32,
    indirect: vec3<f32>,
    n_rays: f32,
    /// Sum of the hits' depths below the face [cells].
    depth: f32,
    /// How many of the hits lie on a surface that looks along the axis (WALL_COSINE).
    n_wall_hits: f32,
    /// How many of the samples were not finite; their hits count as dark.
    n_rejected: u32,
}

/// Faces whose light is not what was asked for, summed over all frames.
struct FaceFaults {
    /// With samples that were not finite.
    n_rejected: atomic<u32>,
    /// With samples or cones missing, for the driver ended loops early (`math::loops`).
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

/// The record with the note that samples of the newest frame are missing.
fn with_cut(light: FaceLight) -> FaceLight {
    var out = light;
    out.state |= CUT_BIT;
    return out;
}

/// The record as if none of the newest frame's samples had been left out.
fn without_rejection(light: FaceLight) -> FaceLight {
    var out = light;
    out.state &= ~(REJECTED_BIT | CUT_BIT);
    return out;
}

/// Mean depth of the surface below the face, in [0, 1] cells. (In steps of 1/255: with so many hits that
/// the mean moves less, it stays.)
fn hit_depth(light: FaceLight) -> f32 {
    return unpack4x8unorm(light.state).x;
}

/// Share of the hits that lie on walls, in [0, 1]; in the same steps.
fn wall_share(light: FaceLight) -> f32 {
    return unpack4x8unorm(light.state).y;
}

/// The record with a frame's samples added.
///
/// `max_rays` ≥ 1: beyond so many the oldest fade, so that the record follows slow changes.
/// `light_rays`, at least the frame's own: how many of the face's rays belong to the light as it is now;
/// older ones still tell what stands in the cell, and their light is forgotten. Each mean is a mixture
/// whose weights sum to 1: energy is neither gained nor lost.
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
    let walls = (wall_share(before) * old_hits + samples.n_wall_hits) / after.n_hits;
    after.state = pack4x8unorm(vec4<f32>(depth, walls, 0.0, 0.0))
        | select(0u, REJECTED_BIT, samples.n_rejected > 0u);
    if samples.n_hits == 0.0 {
        // Without a hit in this frame, the light stays.
        after.direct = before.direct;
        after.indirect = before.indirect;
        after.feedback = before.feedback;
        return after;
    }
    // Of the face's hits, about this many saw the light as it is now, this frame's included.
    let light_hits = max(after.n_hits * min(light_rays / after.n_rays, 1.0), samples.n_hits);
    let share = select(samples.n_hits / light_hits, 1.0, old_hits == 0.0);
    let direct = samples.direct / samples.n_hits;
    let indirect = samples.indirect / samples.n_hits;
    // (`mix` by 1 may not give the second value where the first one is huge.)
    after.direct = before.direct * (1.0 - share) + direct * share;
    let recent = min(RECENCY * share, 1.0);
    after.indirect = before.indirect * (1.0 - recent) + indirect * recent;
    after.feedback = indirect;
    return after;
}

/// In how many frames something was deposited.
fn n_deposits(light: FaceLight) -> u32 {
    return (light.state >> DEPOSITS_SHIFT) & DEPOSITS_MAX;
}

/// A record as [`renew`] returns it, with the deposits of another: its direct light, which was not found by its own rays.
///
/// `light`: without deposits. (They are added, not put into their place: the lavapipe of Mesa 25.0 loses them where
/// `light.state & ~DEPOSITS_MASK` follows the packing in `renew`.)
fn keep_deposits(light: FaceLight, before: FaceLight) -> FaceLight {
    var out = light;
    out.direct = before.direct;
    out.state = light.state | (before.state & DEPOSITS_MASK);
    return out;
}

/// The record with what rays from elsewhere deposited in one frame; `direct` is the mean over the frames
/// in which something was.
///
/// `mean`: rgb irradiance [W·m⁻²], a: number of samples. `light_frames` ≥ 1: how many frames, this one
/// included, saw the light as it is now; what is older is forgotten, and where nothing has come since it is
/// dark.
fn add_deposit(before: FaceLight, mean: vec4<f32>, light_frames: u32) -> FaceLight {
    let n_known = min(n_deposits(before), min(light_frames - 1u, DEPOSITS_MAX - 1u));
    let n_new = select(0u, 1u, mean.a > 0.0);
    let known = select(before.direct, vec3<f32>(0.0), n_known == 0u);
    var after = before;
    after.direct = known + (mean.rgb - known) * (f32(n_new) / f32(max(n_known + n_new, 1u)));
    after.state = (before.state & ~DEPOSITS_MASK) | ((n_known + n_new) << DEPOSITS_SHIFT);
    return after;
}

/// How much of the face a surface covers, in [0, 1]: the share of rays that met one.
fn coverage(light: FaceLight) -> f32 {
    return select(0.0, min(light.n_hits / light.n_rays, 1.0), light.n_rays > 0.0);
}

/// How many of a face's hits belong to the light as it is now, `light_rays` being how many of its rays do.
fn current_hits(light: FaceLight, light_rays: f32) -> f32 {
    return light.n_hits * min(light_rays / max(light.n_rays, 1.0), 1.0);
}

/// How much of the face walls cover, in [0, 1].
fn wall_coverage(light: FaceLight) -> f32 {
    return coverage(light) * wall_share(light);
}

/// Whether light has been found on the face.
fn is_lit(light: FaceLight) -> bool {
    return any(light.direct + light.indirect > vec3<f32>(0.0));
}
