// SPDX-License-Identifier: MIT OR Apache-2.0
//! Irradiance that is kept for the faces of voxels, and how it is renewed.
//!
//! A face of an occupied voxel keeps the mean irradiance of those surface points in the cell that
//! are met first by rays along the face's axis, from outside. Such rays, spread evenly over the
//! face, meet a surface with a density of |cos| to the axis: the mean weighs each piece of surface
//! by its area and max(dot(face normal, surface normal), 0), as anisotropic voxels do (SOURCES:
//! J. Silva, "Ray-traced voxel global illumination", 2020, future work).
//!
//! * *direct*: irradiance straight from lights, emissive surfaces and the sky [W·m⁻²]
//! * *indirect*: irradiance that was reflected at least once [W·m⁻²]
#define_import_path lucerna::voxel_rt::cache

/// A face's record. All zero: nothing is known.
struct FaceLight {
    /// Mean over the hits [W·m⁻²].
    direct: vec3<f32>,
    /// Rays along the axis that met a surface, each weighed by its age; ≤ `n_rays`.
    n_hits: f32,
    /// Mean over the hits [W·m⁻²].
    indirect: vec3<f32>,
    /// Rays along the axis, weighed alike.
    n_rays: f32,
}

/// What one frame adds to a record: sums over its hits.
struct FaceSamples {
    direct: vec3<f32>,
    n_hits: f32,
    indirect: vec3<f32>,
    n_rays: f32,
}

/// The record with a frame's samples added.
///
/// `keep`: how much of what was known counts, in [0, 1]; 1 makes a plain mean. `max_rays`: beyond so
/// many the oldest fade, so that the record follows slow changes; above 0. The result is a weighted
/// mean of samples whose weights sum to 1, so energy is neither gained nor lost.
fn renew(before: FaceLight, samples: FaceSamples, keep: f32, max_rays: f32) -> FaceLight {
    let room = max(max_rays - samples.n_rays, 0.0);
    let fade = keep * select(1.0, room / before.n_rays, before.n_rays > room);
    let old_hits = fade * before.n_hits;
    let n_hits = old_hits + samples.n_hits;
    let n_rays = fade * before.n_rays + samples.n_rays;
    if !(n_hits > 0.0) {
        return FaceLight(vec3<f32>(0.0), 0.0, vec3<f32>(0.0), n_rays);
    }
    return FaceLight(
        (before.direct * old_hits + samples.direct) / n_hits,
        n_hits,
        (before.indirect * old_hits + samples.indirect) / n_hits,
        n_rays,
    );
}

/// How much of the face a surface covers, in [0, 1]: the share of rays that met one.
fn coverage(light: FaceLight) -> f32 {
    return select(0.0, light.n_hits / light.n_rays, light.n_rays > 0.0);
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
