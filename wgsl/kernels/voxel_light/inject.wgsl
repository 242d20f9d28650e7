// SPDX-License-Identifier: MIT OR Apache-2.0
//! Traces rays from a light or from the camera and deposits the irradiance at their hits into voxels.
//!
//! `inject_light`: rays leave the light; at the first hit E = I·cosθ/d² (point, spot) or
//! E = E⊥·cosθ (directional), as in the source of `voxel-rt`.
//! `inject_extended`: rays leave the emissive triangles and the sky, all at once. The ray only
//! chooses the place: E there comes from one light drawn afresh with a shadow ray, for which no area of
//! the voxel's surface need be known (a photon estimate would need it).
//! `inject_camera`: rays leave the camera; E at the first hit comes from one drawn light of any kind
//! with a shadow ray.
//! `inject_samples`: values whose records are known already.
//!
//! What the mean of a record tends to: ∫ E·p dA / ∫ p dA over the voxel's surface, p the density of
//! the hits. From the camera p is what the pixels see. From a light p is proportional to what that
//! light sends there (parts in its shadow get no rays and do not darken the mean; nearer and more
//! directly lit parts count more): too bright where E varies within a voxel, exact where it does not.
//!
//! Each invocation takes RUN_SIDE × RUN_SIDE neighbouring rays (or RUN samples in a row). With
//! STRATEGY_EXACT those that follow each other into one record are summed in registers first.
//!
//! Dispatch: ceil(n_rays/32)² workgroups, one for 32 × 32 rays; `inject_samples`: ceil(n_samples/1024).
//! Workgroup memory: none.

#import lucerna::camera::primary_ray::{Camera, primary_ray}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::scene::light_rays::{punctual_ray, extended_ray}
#import lucerna::scene::lights::{punctual_light, ray_to_light, sample_light}
#import lucerna::scene::rays::{Ray, nearest_hit, any_hit, hit_is_miss}
#import lucerna::scene::surface::{Surface, seen_from, surface_at}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::loops::loops_run
#import lucerna::sampling::pcg::random_vec4
#import lucerna::sampling::stratified::stratified_number
#import lucerna::components::voxel_light::accumulator::{STRATEGY_STORE, STRATEGY_MOVING_AVERAGE, STRATEGY_MAX, STRATEGY_EXACT}
#import lucerna::components::voxel_light::accumulator::{HEAD_WORDS, HEAD_REJECTED, HEAD_CLAMPED, HEAD_OUTSIDE, HEAD_CUT, EXACT_WORDS, EXACT_COUNT, EXACT_HIGH}
#import lucerna::components::voxel_light::average::{WideSum, QUANTA_MAX, SAMPLE_FINE, SAMPLE_REJECTED}
#import lucerna::components::voxel_light::average::{check_sample, quantise, add_to_sum, carry_of, pack_average, moving_average_step, PACKED_COUNT_MAX}
#import lucerna::components::voxels::bricks::{NO_SLOT, brick_of_cell, bit_of_cell, slot_of_bit}
#import lucerna::components::voxels::face_choice::choose_face
#import lucerna::components::voxels::grid::{VoxelGrid, grid_from_world, is_inside}

const WORKGROUP: u32 = 8u;
/// Rays of an invocation along each axis: more make fewer writes and fewer invocations.
const RUN_SIDE: u32 = 4u;
/// Samples of an invocation.
const RUN: u32 = 16u;
const_assert RUN == RUN_SIDE * RUN_SIDE;
// Sums of 2³² − 1 samples fit 64 bits.
const_assert QUANTA_MAX < 4294967296.0;

/// Chosen when the pipeline is made: the others' code drops out.
override STRATEGY: u32 = 3u;

/// One dispatch.
struct Injection {
    camera: Camera,
    /// Rays along each side of the square.
    n_rays: u32,
    /// Stream of random numbers.
    seed: u32,
    /// Of `inject_light`: index of a punctual light. Part of the random numbers' stream in all.
    light: u32,
    n_samples: u32,
    /// See `lucerna::components::voxel_light::average`; a power of two.
    quanta_per_unit: f32,
    /// 1/largest value: what the packed words hold as 1.
    unorm_per_unit: f32,
    reserved_a: u32,
    reserved_b: u32,
}

/// A value on its way to a record.
struct VoxelSample {
    /// Irradiance [W·m⁻²].
    value: vec3<f32>,
    /// slot · n_faces + face; NO_SLOT and whatever lies beyond the grid's capacity is counted as outside.
    record: u32,
}

/// Samples in a row that go to one record.
struct Run {
    sum: WideSum,
    count: u32,
    record: u32,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> injection: Injection;
/// Occupied bits and first slot of each brick, then a cell of each slot; see `lucerna::components::voxels::bricks`.
@group(1) @binding(2) var<storage, read> structure: array<vec2<u32>>;
@group(1) @binding(3) var<storage, read_write> accumulators: array<atomic<u32>>;
/// Of `inject_samples`.
@group(2) @binding(0) var<storage, read> samples: array<VoxelSample>;

fn start_run() -> Run {
    return Run(WideSum(vec3<u32>(0u), vec3<u32>(0u)), 0u, NO_SLOT);
}

/// Adds a channel's 64-bit sum to memory: what wraps out of the low word goes to the high one.
fn add_channel(low_ix: u32, low: u32, high: u32) {
    let old = atomicAdd(&accumulators[low_ix], low);
    let up = high + carry_of(vec3<u32>(old), vec3<u32>(low)).x;
    if up != 0u {
        atomicAdd(&accumulators[low_ix + EXACT_HIGH], up);
    }
}

/// Writes what a run has summed.
fn end_run(run: Run) {
    if run.count == 0u {
        return;
    }
    let at = HEAD_WORDS + run.record * EXACT_WORDS;
    add_channel(at, run.sum.low.x, run.sum.high.x);
    add_channel(at + 1u, run.sum.low.y, run.sum.high.y);
    add_channel(at + 2u, run.sum.low.z, run.sum.high.z);
    atomicAdd(&accumulators[at + EXACT_COUNT], run.count);
}

fn average_by_compare_and_swap(ix: u32, value_unorm: vec3<f32>) {
    var old = atomicLoad(&accumulators[ix]);
    loop {
        let swapped = atomicCompareExchangeWeak(&accumulators[ix], old, moving_average_step(old, value_unorm));
        if swapped.exchanged {
            break;
        }
        old = swapped.old_value;
    }
}

/// Writes a sample, or with STRATEGY_EXACT adds it to the run.
fn deposit(run: ptr<function, Run>, sample: VoxelSample) {
    if sample.record >= grid.capacity * grid.n_faces {
        atomicAdd(&accumulators[HEAD_OUTSIDE], 1u);
        return;
    }
    let verdict = check_sample(sample.value, injection.quanta_per_unit);
    if verdict != SAMPLE_FINE {
        if verdict == SAMPLE_REJECTED {
            atomicAdd(&accumulators[HEAD_REJECTED], 1u);
            return;
        }
        atomicAdd(&accumulators[HEAD_CLAMPED], 1u);
    }
    if STRATEGY == STRATEGY_EXACT {
        if sample.record != (*run).record {
            end_run(*run);
            *run = start_run();
            (*run).record = sample.record;
        }
        (*run).sum = add_to_sum((*run).sum, quantise(sample.value, injection.quanta_per_unit));
        (*run).count += 1u;
        return;
    }
    let ix = HEAD_WORDS + sample.record;
    let value_unorm = sample.value * injection.unorm_per_unit;
    if STRATEGY == STRATEGY_MOVING_AVERAGE {
        average_by_compare_and_swap(ix, value_unorm);
    } else if STRATEGY == STRATEGY_MAX {
        atomicMax(&accumulators[ix], pack_average(value_unorm, PACKED_COUNT_MAX));
    } else if STRATEGY == STRATEGY_STORE {
        atomicStore(&accumulators[ix], pack_average(value_unorm, PACKED_COUNT_MAX));
    }
}

/// The record of a point on a surface, or NO_SLOT. `normal`: unit length, on the lit side.
fn record_of(position: vec3<f32>, normal: vec3<f32>, u: f32) -> u32 {
    let cell = vec3<i32>(floor(grid_from_world(grid, position)));
    if !is_inside(grid, cell) {
        return NO_SLOT;
    }
    let brick = structure[brick_of_cell(grid, vec3<u32>(cell))];
    let slot = slot_of_bit(brick.x, brick.y, bit_of_cell(vec3<u32>(cell)));
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
    return vec2<f32>(
        stratified_number(ray.x, injection.n_rays, jitter.x),
        stratified_number(ray.y, injection.n_rays, jitter.y),
    );
}

/// Irradiance by one drawn light [W·m⁻²]. `extended_only`: lights without extent give nothing.
fn drawn_irradiance(surface: Surface, u: vec4<f32>, extended_only: bool) -> vec3<f32> {
    let light = sample_light(surface.position, u);
    let cosine = dot(surface.shading_normal, light.direction);
    let hidden = dot(surface.geometric_normal, light.direction) <= 0.0 || cosine <= 0.0;
    if hidden || all(light.weight == vec3<f32>(0.0)) || (extended_only && light.pdf == 0.0) {
        return vec3<f32>(0.0);
    }
    let origin = offset_ray_origin(
        surface.position,
        surface.position_error,
        surface.geometric_normal,
        light.direction,
    );
    return select(light.weight * cosine, vec3<f32>(0.0), any_hit(ray_to_light(light, origin)));
}

/// Whether what the k-th ray of an invocation found can be trusted; if not, it and those after it are counted.
fn ray_is_whole(k: u32) -> bool {
    // (No square has 2³¹ rays along a side.)
    if loops_run(injection.n_rays >> 31u) {
        return true;
    }
    atomicAdd(&accumulators[HEAD_CUT], RUN - k);
    return false;
}

/// The k-th ray of an invocation; it may lie beyond the square.
fn ray_of_run(id: vec3<u32>, k: u32) -> vec2<u32> {
    return id.xy * RUN_SIDE + vec2<u32>(k % RUN_SIDE, k / RUN_SIDE);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_light(@builtin(global_invocation_id) id: vec3<u32>) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ray = ray_of_run(id, k);
        if any(ray >= vec2<u32>(injection.n_rays)) {
            continue;
        }
        let random = random_of_ray(ray, 0u);
        let path = punctual_ray(injection.light, square_point(ray, random.xy));
        let hit = nearest_hit(Ray(path.origin, 0.0, path.direction, FLOAT_MAX));
        if hit_is_miss(hit) {
            // (A ray that was cut short may look like a miss, and loops end after it.)
            if !ray_is_whole(k) {
                break;
            }
            continue;
        }
        let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), path.direction);
        let light = punctual_light(injection.light, surface.position);
        let value = light.weight * max(dot(surface.shading_normal, light.direction), 0.0);
        if !ray_is_whole(k) {
            break;
        }
        deposit(&run, VoxelSample(value, record_of(surface.position, surface.geometric_normal, random.z)));
    }
    end_run(run);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_extended(@builtin(global_invocation_id) id: vec3<u32>) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ray = ray_of_run(id, k);
        if any(ray >= vec2<u32>(injection.n_rays)) {
            continue;
        }
        let random = random_of_ray(ray, 0u);
        let place = vec4<f32>(square_point(ray, random.xy), random.zw);
        let path = extended_ray(place, random_of_ray(ray, 1u));
        let hit = nearest_hit(Ray(path.origin, 0.0, path.direction, FLOAT_MAX));
        if hit_is_miss(hit) {
            // (A ray that was cut short may look like a miss, and loops end after it.)
            if !ray_is_whole(k) {
                break;
            }
            continue;
        }
        let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), path.direction);
        let value = drawn_irradiance(surface, random_of_ray(ray, 2u), true);
        let face_random = random_of_ray(ray, 3u).x;
        if !ray_is_whole(k) {
            break;
        }
        deposit(&run, VoxelSample(value, record_of(surface.position, surface.geometric_normal, face_random)));
    }
    end_run(run);
}

@compute @workgroup_size(WORKGROUP, WORKGROUP)
fn inject_camera(@builtin(global_invocation_id) id: vec3<u32>) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ray = ray_of_run(id, k);
        if any(ray >= vec2<u32>(injection.n_rays)) {
            continue;
        }
        let random = random_of_ray(ray, 0u);
        let path = primary_ray(injection.camera, square_point(ray, random.xy));
        let hit = nearest_hit(Ray(path.origin, 0.0, path.direction, FLOAT_MAX));
        if hit_is_miss(hit) {
            // (A ray that was cut short may look like a miss, and loops end after it.)
            if !ray_is_whole(k) {
                break;
            }
            continue;
        }
        let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), path.direction);
        let value = drawn_irradiance(surface, random_of_ray(ray, 1u), false);
        if !ray_is_whole(k) {
            break;
        }
        deposit(&run, VoxelSample(value, record_of(surface.position, surface.geometric_normal, random.z)));
    }
    end_run(run);
}

@compute @workgroup_size(WORKGROUP * WORKGROUP)
fn inject_samples(@builtin(global_invocation_id) id: vec3<u32>) {
    var run = start_run();
    for (var k = 0u; k < RUN; k++) {
        let ix = id.x * RUN + k;
        if ix < injection.n_samples {
            deposit(&run, samples[ix]);
        }
    }
    end_run(run);
}
