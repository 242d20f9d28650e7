// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance that is kept for the faces of voxels, and how it is renewed.
//!
//! A face of an occupied voxel keeps the mean irradiance of those surface points in the cell that
//! are met first by rays along the face's axis, from outside, and are not shut in (see the kernel
//! voxel_rt/gather). Such rays, spread evenly over the
//! face, meet a surface with a density of |cos| to the axis: the mean weighs each piece of surface
//! by its area and max(dot(face normal, surface normal), 0), as the
//! anisotropic voxels that T. Magalhães, "Real-Time Ray Traced Voxel Global Illumination", University
//! of Porto, 2020, names as future work.
//!
//! * *direct*: irradiance straight from lights, emissive surfaces and the sky [W·m⁻²]
//! * *indirect*: irradiance that was reflected at least once [W·m⁻²]
#define_import_path lucerna::voxel_rt::cache

/// A face's record. All zero: nothing is known.
struct FaceLight {
    /// Mean over the hits [W·m⁻²].
    direct: vec3<f32>,
    /// Rays along the axis that met a surface, each weighed by its age.
    n_hits: f32,
    /// Mean over the hits [W·m⁻²].
    indirect: vec3<f32>,
    /// Two 16-bit floats: rays along the axis, weighed alike (low), and the mean depth of the hits
    /// below the face, in cells (high). The high one's sign is set if a sample of the newest frame was
    /// not finite and was left out.
    rays_and_depth: u32,
}

/// The sign of the depth.
const REJECTED_BIT: u32 = 0x80000000u;

/// What one frame adds to a record: sums over its hits.
struct FaceSamples {
    direct: vec3<f32>,
    n_hits: f32,
    indirect: vec3<f32>,
    n_rays: f32,
    /// Sum of the hits' depths below the face [cells].
    depth: f32,
    /// How many of the samples were not finite; their hits count as dark.
    n_rejected: u32,
}

/// Whether the newest frame's samples were not all finite.
fn has_rejected(light: FaceLight) -> bool {
    return (light.rays_and_depth & REJECTED_BIT) != 0u;
}

/// Rays that a record remembers.
fn ray_count(light: FaceLight) -> f32 {
    return unpack2x16float(light.rays_and_depth).x;
}

/// Mean depth of the surface below the face, in cells.
fn hit_depth(light: FaceLight) -> f32 {
    return abs(unpack2x16float(light.rays_and_depth).y);
}

/// The record with a frame's samples added.
///
/// `max_rays`, in [1, 2048] (16-bit floats count no further): beyond so many the oldest fade, so that
/// the record follows slow changes. `light_rays`, at least the frame's own: how many of the face's rays
/// belong to the light as it is now; older ones still tell what stands in the cell, and their light is
/// forgotten. Each mean is a mixture whose weights sum to 1: energy is neither gained nor lost.
fn renew(before: FaceLight, samples: FaceSamples, light_rays: f32, max_rays: f32) -> FaceLight {
    let rays_before = ray_count(before);
    let room = max(max_rays - samples.n_rays, 0.0);
    let fade = select(1.0, room / rays_before, rays_before > room);
    let old_hits = fade * before.n_hits;
    let n_hits = old_hits + samples.n_hits;
    let n_rays = fade * rays_before + samples.n_rays;
    if !(n_hits > 0.0) {
        return FaceLight(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), pack2x16float(vec2<f32>(n_rays, 0.0)));
    }
    // Of the face's hits, about this many saw the light as it is now, this frame's included.
    let light_hits = max(n_hits * min(light_rays / n_rays, 1.0), samples.n_hits);
    let old_share = select(0.0, (light_hits - samples.n_hits) / light_hits, old_hits > 0.0);
    let new_share = select(0.0, 1.0 / light_hits, light_hits > 0.0);
    let depth = (hit_depth(before) * old_hits + samples.depth) / n_hits;
    // Without a hit in this frame, the light stays.
    let keeps = samples.n_hits == 0.0;
    return FaceLight(
        select(before.direct * old_share + samples.direct * new_share, before.direct, keeps),
        n_hits,
        select(before.indirect * old_share + samples.indirect * new_share, before.indirect, keeps),
        pack2x16float(vec2<f32>(n_rays, depth)) | select(0u, REJECTED_BIT, samples.n_rejected > 0u),
    );
}

/// How much of the face a surface covers, in [0, 1]: the share of rays that met one.
fn coverage(light: FaceLight) -> f32 {
    let n_rays = ray_count(light);
    return select(0.0, min(light.n_hits / n_rays, 1.0), n_rays > 0.0);
}

/// A weighted sum of records.
struct LightSum {
    direct: vec3<f32>,
    weight: f32,
    indirect: vec3<f32>,
}

/// Adds a record with a weight ≥ 0.
fn add_light(sum: LightSum, light: FaceLight, weight: f32) -> LightSum {
    return LightSum(
        sum.direct + weight * light.direct,
        sum.weight + weight,
        sum.indirect + weight * light.indirect,
    );
}

/// Adds another sum's mean with a weight; `found.weight` > 0.
fn add_share(sum: LightSum, found: LightSum, weight: f32) -> LightSum {
    let scale = weight / found.weight;
    return LightSum(
        sum.direct + scale * found.direct,
        sum.weight + weight,
        sum.indirect + scale * found.indirect,
    );
}
