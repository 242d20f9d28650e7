// SPDX-License-Identifier: MIT OR Apache-2.0
//! Renews the irradiance of every face of every occupied voxel by a few rays.
//!
//! A ray along the face's axis, through a random point of the face, finds a surface point within the
//! cell. There a shadow ray to a drawn light estimates the direct irradiance, and a cosine-distributed
//! ray the indirect one: what it meets reflects the irradiance that the cache held there in the frame
//! before, so each frame adds a bounce.
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), 64 a workgroup, workgroups in
//! rows of at most 32768. Workgroup memory: none. Each invocation owns one record of `after` and reads
//! only `before`: the same input gives the same bytes.

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::host::lights::sample_light
#import lucerna::host::rays::{Ray, nearest_hit, any_hit, hit_is_miss}
#import lucerna::host::surface::{Surface, surface_at}
#import lucerna::math::constants::FLOAT_MAX
#import lucerna::math::float::all_finite
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::{pcg3d, random_vec4}
#import lucerna::voxel::bricks::{NO_SLOT, bit_of_cell, brick_of_cell, slot_of_bit}
#import lucerna::voxel::grid::{VoxelGrid, face_axis, face_normal, faces_of_direction, grid_from_world, is_inside, unpack_cell, world_from_grid}
#import lucerna::voxel::lookup::{Taps, face_weights, tap_cell, tap_weight, taps_at}
#import lucerna::voxel_rt::cache::{FaceLight, FaceSamples, LightSum, add_light, coverage, renew}

const WORKGROUP: u32 = 64u;
/// Rays along the axis start so far before the face and end so far behind the opposite one [cells]:
/// a surface on the border between two cells belongs to both.
const BORDER: f32 = 1e-3;
/// How far the point looked up is moved along its normal [cells], so that no cell behind the surface
/// is among the taps.
const NORMAL_OFFSET: f32 = 0.5;
/// Faces that so many rays found empty are tried again only in one frame of `EMPTY_PERIOD`.
const EMPTY_AFTER: f32 = 16.0;
const EMPTY_PERIOD: u32 = 16u;
/// Bits of `flags`: sample lights; sample bounces; reflected light counts again (else: direct only).
const GATHER_DIRECT: u32 = 1u;
const GATHER_BOUNCE: u32 = 2u;
const GATHER_FEEDBACK: u32 = 4u;

struct GatherInfo {
    frame: u32,
    seed: u32,
    /// Points drawn on each face.
    n_points: u32,
    flags: u32,
    /// How much of what was known counts, see `cache::renew`.
    keep: f32,
    max_rays: f32,
    reserved_a: u32,
    reserved_b: u32,
}

@group(1) @binding(0) var<uniform> grid: VoxelGrid;
@group(1) @binding(1) var<uniform> info: GatherInfo;
/// x: occupied voxels.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
/// The bricks' words, then a packed cell for each slot.
@group(1) @binding(3) var<storage, read> structure: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read> before: array<FaceLight>;
@group(1) @binding(5) var<storage, read_write> after: array<FaceLight>;

/// What the cache held at a surface point, by validity-weighted trilinear interpolation.
fn cached_light(position: vec3<f32>, normal: vec3<f32>) -> LightSum {
    let weights = face_weights(grid, normal);
    let faces = select(faces_of_direction(normal), vec3<u32>(0u), grid.n_faces == 1u);
    let taps = taps_at(grid_from_world(grid, position) + normal * NORMAL_OFFSET);
    var sum: LightSum;
    for (var ix = 0u; ix < 8u; ix++) {
        let cell = tap_cell(taps, ix);
        if !is_inside(grid, cell) {
            continue;
        }
        let brick = structure[brick_of_cell(grid, vec3<u32>(cell))];
        let slot = slot_of_bit(brick.x, brick.y, bit_of_cell(vec3<u32>(cell)));
        if slot == NO_SLOT {
            continue;
        }
        let weight = tap_weight(taps, ix);
        for (var axis = 0u; axis < 3u; axis++) {
            if weights[axis] > 0.0 {
                let light = before[slot * grid.n_faces + faces[axis]];
                sum = add_light(sum, light, weight * weights[axis] * coverage(light));
            }
        }
    }
    return sum;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(num_workgroups) n_groups: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = (group.y * n_groups.x + group.x) * WORKGROUP + local;
    if record >= counts.x * grid.n_faces {
        return;
    }
    let slot = record / grid.n_faces;
    let n_bricks = grid.bricks.x * grid.bricks.y * grid.bricks.z;
    let packed_cell = structure[n_bricks + slot].x;
    let known = before[record];
    let hash = pcg3d(vec3<u32>(packed_cell, record % grid.n_faces, info.seed));
    if known.n_hits == 0.0 && known.n_rays >= EMPTY_AFTER && (info.frame + hash.x) % EMPTY_PERIOD != 0u {
        after[record] = known;
        return;
    }
    var samples: FaceSamples;
    for (var point = 0u; point < info.n_points; point++) {
        let sample_ix = info.frame * info.n_points + point;
        samples = add_sample(samples, packed_cell, record % grid.n_faces, sample_ix, hash);
    }
    after[record] = renew(known, samples, info.keep, info.max_rays);
}

/// Draws one point of a face and adds what light it receives.
fn add_sample(
    samples_before: FaceSamples,
    packed_cell: u32,
    record_face: u32,
    sample_ix: u32,
    hash: vec3<u32>,
) -> FaceSamples {
    var samples = samples_before;
    samples.n_rays += 1.0;
    // A cell without faces is looked at from its six sides in turn.
    let face = select(record_face, (sample_ix + hash.x) % 6u, grid.n_faces == 1u);
    let axis = face_axis(face);
    let outward = face_normal(face);
    let place = sobol_owen(sample_ix, hash.x);
    var start = vec3<f32>(0.5);
    start[(axis + 1u) % 3u] = place.x;
    start[(axis + 2u) % 3u] = place.y;
    start += outward * (0.5 + BORDER);
    let origin = world_from_grid(grid, vec3<f32>(unpack_cell(packed_cell)) + start);
    let hit = nearest_hit(Ray(origin, 0.0, -outward, grid.cell * (1.0 + 2.0 * BORDER)));
    if hit_is_miss(hit) {
        return samples;
    }
    let surface = surface_at(hit.triangle, hit.barycentrics);
    let side = select(-1.0, 1.0, dot(surface.geometric_normal, outward) > 0.0);
    let geometric_normal = surface.geometric_normal * side;
    let normal = surface.shading_normal * side;
    samples.n_hits += 1.0;

    if (info.flags & GATHER_DIRECT) != 0u {
        let u = random_vec4(hash.yz, sample_ix, 0u);
        let light = sample_light(surface.position, vec4<f32>(u.x, sobol_owen(sample_ix, hash.z), u.w));
        let cosine = dot(light.direction, normal);
        if cosine > 0.0 && dot(light.direction, geometric_normal) > 0.0 && any(light.weight > vec3<f32>(0.0)) {
            let from_here = offset_ray_origin(
                surface.position,
                surface.position_error,
                geometric_normal,
                light.direction,
            );
            var shadow = Ray(from_here, 0.0, light.direction, FLOAT_MAX);
            if light.distance < FLOAT_MAX {
                shadow = Ray(from_here, 0.0, light.place - from_here, 1.0);
            }
            let direct = light.weight * cosine;
            if all_finite(direct) && !any_hit(shadow) {
                samples.direct += direct;
            }
        }
    }
    if (info.flags & GATHER_BOUNCE) == 0u {
        return samples;
    }
    let direction = frame_from_normal(normal) * sample_cosine_hemisphere(sobol_owen(sample_ix, hash.y));
    if dot(direction, geometric_normal) <= 0.0 {
        return samples;
    }
    let from_here = offset_ray_origin(surface.position, surface.position_error, geometric_normal, direction);
    let far = nearest_hit(Ray(from_here, 0.0, direction, FLOAT_MAX));
    if hit_is_miss(far) {
        return samples;
    }
    let met = surface_at(far.triangle, far.barycentrics);
    let met_normal = met.shading_normal * select(-1.0, 1.0, dot(met.geometric_normal, direction) < 0.0);
    let found = cached_light(met.position, met_normal);
    if found.weight > 0.0 {
        let feedback = select(0.0, 1.0, (info.flags & GATHER_FEEDBACK) != 0u);
        let arriving = (found.direct + feedback * found.indirect) / found.weight;
        var albedo = met.base_color;
        if !met.lambert {
            let material = metallic_roughness(met.base_color, met.metallic, met.roughness);
            albedo = directional_albedo(material, abs(dot(direction, met_normal)));
        }
        // Radiance albedo/π · E, times π: the cosine cancels with its density.
        let indirect = albedo * arriving;
        if all_finite(indirect) {
            samples.indirect += indirect;
        }
    }
    return samples;
}
