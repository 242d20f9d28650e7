// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: cones through the voxels, each followed along its axis from surface to surface.
//!
//! Interface: `ConeResult`, `trace_cone`, `start_height`. No bindings of its own: it reads `fields::voxel_surfels`. A cone's width makes no
//! difference: many cones, each along a direction of its own, integrate what a wide one would average.
#define_import_path lucerna::fields::cone_trace

#import lucerna::cone::march::{Cone, ConeSettings}
#import lucerna::fields::voxel_surfels::trace_surfels

/// The result of a cone.
struct ConeResult {
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
    /// Share of the cone that hit nothing, in [0, 1].
    transmittance: f32,
    /// The same, within the distance `near`.
    near_transmittance: f32,
    n_steps: u32,
    reserved_a: u32,
    reserved_b: u32,
}

/// How far along the normal a cone starts [m]: not at all, because the surface's own surfels do not face it.
fn start_height(position: vec3<f32>, normal: vec3<f32>, settings: ConeSettings) -> f32 {
    return 0.0;
}

/// Follows a cone's axis to its end. `near`: distance up to which `near_transmittance` counts [m].
fn trace_cone(cone: Cone, settings: ConeSettings, near: f32) -> ConeResult {
    let origin = cone.origin + cone.offset * cone.normal;
    let found = trace_surfels(origin, cone.normal, cone.direction, cone.max_distance, near);
    return ConeResult(found.radiance, found.transmittance, found.near_transmittance, found.n_steps, 0u, 0u);
}
