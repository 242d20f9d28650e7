// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces rays from a light or from the camera and deposits the irradiance at their hits into voxels.
//!
//! `inject_light`: rays start at a light without extent; `inject_extended`: at the emissive triangles and the sky;
//! `inject_camera`: at the camera (`lucerna::integrators::injection`). `inject_samples`: deposits values whose records
//! are known already.
//!
//! The mean of a record converges to ∫ E·p dA / ∫ p dA over the voxel's surface, where p is the density of the hits.
//! From the camera, p is what the pixels see. From a light, p is proportional to what that light sends there (parts in
//! its shadow get no rays and do not darken the mean; nearer and more directly lit parts count more): the mean is too
//! bright if E varies within a voxel, and exact if it does not.
//!
//! Each invocation traces RUN_SIDE × RUN_SIDE neighbouring rays (or takes RUN samples in a row). With STRATEGY_EXACT,
//! consecutive samples of the same record are summed in registers first.
//!
//! Dispatch: ceil(n_rays/32)² workgroups, one for 32 × 32 rays; `inject_samples`: ceil(n_samples/1024).
//! Workgroup memory: none.

#import lucerna::camera::primary_ray::Camera
#import lucerna::components::voxel_light::accumulator::STRATEGY_EXACT
#import lucerna::components::voxels::face_choice::choose_face
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world}
#import lucerna::fields::voxel_accumulators::{DepositSettings, Run, VoxelSample, count_cut, deposit, end_run, start_run}
#import lucerna::fields::voxel_structure::slot_in_grid
#import lucerna::integrators::injection::{LitPoint, lit_by_extended, lit_by_punctual, lit_in_view}
#import lucerna::math::loops::loops_run
#import lucerna::sampling::pcg::random_vec4
#import lucerna::sampling::stratified::stratified_in_cell

const WORKGROUP: u32 = 8u;
/// Rays of an invocation along each axis: more rays mean fewer writes and fewer invocations.
const RUN_SIDE: u32 = 4u;
/// Samples of an invocation.
const RUN: u32 = 16u;
const_assert RUN == RUN_SIDE * RUN_SIDE;

/// Chosen when the pipeline is created, so that the code of the others is dropped.
override STRATEGY: u32 = STRATEGY_EXACT;

/// One dispatch.
struct Injection {
    camera: Camera,
    /// Rays along each side of the square.
    n_rays: u32,
    /// Seed of the random numbers.
    seed: u32,
    /// For `inject_light`, the index of a punctual light. For all, a part of the random numbers' stream.
    light: u32,
    n_samples: u32,
    /// See `lucerna::components::voxel_light::average`; a power of two.
    quanta_per_unit: f32,
    /// 1/largest value, which packed words store as 1.
    unorm_per_unit: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> injection: Injection;
/// For `inject_samples`.
@group(2) @binding(0) var<storage, read> samples: array<VoxelSample>;

/// How samples are written.
fn settings_of_deposits() -> DepositSettings {
    let n_records = grid.capacity * grid.n_faces;
    return DepositSettings(STRATEGY, n_records, injection.quanta_per_unit, injection.unorm_per_unit);
}

/// The record of a point on a surface, or NO_SLOT. `normal`: unit length, on the lit side.
fn record_of(position: vec3<f32>, normal: vec3<f32>, u: f32) -> u32 {
    let slot = slot_in_grid(grid, 0u, vec3<i32>(floor(grid_from_world(grid, position))));
    if slot >= grid.capacity || grid.n_faces == 1u {
        return slot;
    }
    return slot * grid.n_faces + choose_face(normal, u);
}

/// Four numbers in [0, 1) of a ray.
fn random_of_ray(ray: vec2<u32>, dimension: u32) -> vec4<f32> {
    return random_vec4(vec2<u32>(ray.y * injection.n_rays + ray.x, injection.seed), injection.light, dimension);
}

/// The ray's point of the stratified square.
fn square_point(ray: vec2<u32>, jitter: vec2<f32>) -> vec2<f32> {
    return stratified_in_cell(ray, vec2<u32>(injection.n_rays), jitter);
}

/// Whether the result of an invocation's k-th ray can be trusted; if not, it and the rays after it are counted. (A ray
/// that was cut short may look like a miss, and loops end after it.)
fn ray_is_whole(k: u32) -> bool {
    // (No square has 2³¹ rays along a side.)
    if loops_run(injection.n_rays >> 31u) {
        return true;
    }
    count_cut(RUN - k);
    return false;
}

/// The k-th ray of an invocation; it may be outside the square.
fn ray_of_run(id: vec3<u32>, k: u32) -> vec2<u32> {
    return id.xy * RUN_SIDE + vec2<u32>(k % RUN_SIDE, k / RUN_SIDE);
}

/// Writes the point that a ray has lit. `u`: uniform in [0, 1), chooses the voxel's face.
fn deposit_point(run: ptr<function, Run>, lit: LitPoint, u: f32) {
    if lit.is_surface {
        deposit(run, settings_of_deposits(), VoxelSample(lit.irradiance, record_of(lit.position, lit.normal, u)));
    }
}

/// Where rays start.
const FROM_LIGHT: u32 = 0u;
const FROM_EXTENDED: u32 = 1u;
const FROM_CAMERA: u32 = 2u;

/// Traces and writes the rays of an invocation. `source`: a FROM_ constant.
fn inject_rays(id: vec3<u32>, source: u32) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ray = ray_of_run(id, k);
        if any(ray >= vec2<u32>(injection.n_rays)) {
            continue;
        }
        let random = random_of_ray(ray, 0u);
        let point = square_point(ray, random.xy);
        var lit: LitPoint;
        var choice = random.z;
        if source == FROM_LIGHT {
            lit = lit_by_punctual(injection.light, point);
        } else if source == FROM_EXTENDED {
            lit = lit_by_extended(vec4<f32>(point, random.zw), random_of_ray(ray, 1u), random_of_ray(ray, 2u));
            choice = random_of_ray(ray, 3u).x;
        } else {
            lit = lit_in_view(injection.camera, point, random_of_ray(ray, 1u));
        }
        if !ray_is_whole(k) {
            break;
        }
        deposit_point(&run, lit, choice);
    }
    end_run(run);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_light(@builtin(global_invocation_id) id: vec3<u32>) {
    inject_rays(id, FROM_LIGHT);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_extended(@builtin(global_invocation_id) id: vec3<u32>) {
    inject_rays(id, FROM_EXTENDED);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_camera(@builtin(global_invocation_id) id: vec3<u32>) {
    inject_rays(id, FROM_CAMERA);
}

@compute @workgroup_size(WORKGROUP * WORKGROUP)
fn inject_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ix = id.x * RUN + k;
        if ix < injection.n_samples {
            deposit(&run, settings_of_deposits(), samples[ix]);
        }
    }
    end_run(run);
}
