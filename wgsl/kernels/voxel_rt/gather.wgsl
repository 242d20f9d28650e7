// SPDX-License-Identifier: MIT OR Apache-2.0
//! Renews the irradiance of every face of every occupied voxel by a few rays.
//!
//! A ray along the face's axis, through a random point of the face, finds a surface point within the
//! cell. From there a cosine-distributed ray is traced: what it meets reflects the irradiance that the
//! cache held there in the frame before, so each frame adds a bounce; and what it meets emits. A shadow
//! ray to a drawn light estimates the direct irradiance as well, and both estimates of it are combined by
//! multiple importance sampling (E. Veach, L. Guibas, "Optimally Combining Sampling Techniques for Monte
//! Carlo Rendering", SIGGRAPH 1995, power heuristic).
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record of
//! `after` and reads only `before`: the same input gives the same bytes.

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::host::lights::{pdf_of_emitter, pdf_of_sky, ray_to_light, sample_light}
#import lucerna::host::rays::{Ray, nearest_hit, any_hit, hit_is_miss}
#import lucerna::host::sky::sky_radiance
#import lucerna::host::surface::{Surface, seen_from, surface_at}
#import lucerna::math::constants::{FLOAT_MAX, INV_PI, PI}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::mis::power_heuristic
#import lucerna::sampling::pcg::{pcg3d, random_vec4}
#import lucerna::voxel::bricks::{NO_SLOT, bit_of_cell, brick_of_cell, slot_of_bit}
#import lucerna::voxel::grid::{face_axis, face_normal, faces_of_direction, grid_from_world, is_inside, unpack_cell, world_from_grid}
#import lucerna::voxel::levels::{VoxelLevel, VoxelLevels, level_weight, slot_word}
#import lucerna::voxel::lookup::{face_weights, tap_cell, tap_weight, taps_at}
#import lucerna::voxel_rt::cache::{FaceLight, FaceSamples, LightSum, add_share, add_weighted, coverage, renew}
#import lucerna::voxel_rt::walls::{keep_before_walls, undivided}

const WORKGROUP: u32 = 64u;
/// Rays along the axis start so far before the face and end so far behind the opposite one [cells]:
/// a surface on the border between two cells belongs to both.
const BORDER: f32 = 1e-3;
/// How far the point looked up is moved along its normal [cells], so that no cell behind the surface
/// is among the taps.
const NORMAL_OFFSET: f32 = 0.5;
/// How far a point is moved along its normal to tell the cell that its surface stands in [cells]: a
/// surface on a border belongs to the cell before it.
const SIDE_OFFSET: f32 = 1e-2;
/// A bounce that meets the back of a single-sided surface within so many cells was shut in: the point
/// lies within something solid, or behind a wall's foot, where nobody sees it.
const SHUT_IN_CELLS: f32 = 1.5;
/// Faces that so many rays found empty or dark are tried only in one frame of `IDLE_PERIOD`: most are
/// turned into walls or out of the building.
const IDLE_AFTER: f32 = 16.0;
const IDLE_PERIOD: u32 = 16u;

struct GatherInfo {
    frame: u32,
    seed: u32,
    /// Points drawn on each face.
    n_points: u32,
    /// 1: reflected light is reflected again. 0: direct light alone is reflected.
    feedback: u32,
    /// See `cache::renew`.
    light_rays: f32,
    max_rays: f32,
    /// Index of the level whose faces are renewed.
    level: u32,
    reserved: u32,
}

@group(1) @binding(0) var<uniform> levels: VoxelLevels;
@group(1) @binding(1) var<uniform> info: GatherInfo;
/// x: occupied voxels of the level.
@group(1) @binding(2) var<uniform> counts: vec4<u32>;
/// Of each level the bricks' words, then a packed cell for each slot.
@group(1) @binding(3) var<storage, read> structure: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read> before: array<FaceLight>;
@group(1) @binding(5) var<storage, read_write> after: array<FaceLight>;

/// The slot of a cell, or NO_SLOT.
fn slot_of_cell(level: VoxelLevel, cell: vec3<i32>) -> u32 {
    if !is_inside(level.grid, cell) {
        return NO_SLOT;
    }
    let brick = structure[level.first_brick + brick_of_cell(level.grid, vec3<u32>(cell))];
    return slot_of_bit(brick.x, brick.y, bit_of_cell(vec3<u32>(cell)));
}

/// The walls of a voxel (`lucerna::voxel_rt::walls`); none where there is no voxel, or one value a voxel.
fn walls_of_slot(level: VoxelLevel, slot: u32) -> u32 {
    if slot == NO_SLOT || level.grid.n_faces == 1u {
        return 0u;
    }
    return structure[slot_word(level, slot)].y;
}

/// What of a face's light a bounce sees reflected.
fn reflectable(light: FaceLight) -> vec3<f32> {
    return light.direct + select(vec3<f32>(0.0), light.feedback, info.feedback != 0u);
}

/// What a level held around a point of its grid, on the side of the normal: a sum weighted by
/// distance, by how much each face looks that way, and by how much of it a surface covers.
fn light_in_level(level: VoxelLevel, at: vec3<f32>, normal: vec3<f32>) -> LightSum {
    let weights = face_weights(level.grid, normal);
    let faces = select(faces_of_direction(normal), vec3<u32>(0u), level.grid.n_faces == 1u);
    let own_cell = floor(at + normal * SIDE_OFFSET);
    let walls = walls_of_slot(level, slot_of_cell(level, vec3<i32>(own_cell)));
    let taps = taps_at(keep_before_walls(walls, at, own_cell, at + normal * NORMAL_OFFSET));
    var sum: LightSum;
    for (var ix = 0u; ix < 8u; ix++) {
        let slot = slot_of_cell(level, tap_cell(taps, ix));
        if slot == NO_SLOT {
            continue;
        }
        let shares = tap_weight(taps, ix) * weights * undivided(walls_of_slot(level, slot));
        for (var axis = 0u; axis < 3u; axis++) {
            if weights[axis] > 0.0 {
                let light = before[level.first_record + slot * level.grid.n_faces + faces[axis]];
                sum = add_weighted(sum, reflectable(light), shares[axis] * coverage(light));
            }
        }
    }
    return sum;
}

/// The irradiance that the cache held at a surface point [W·m⁻²]; 0 where nothing is known.
fn cached_irradiance(position: vec3<f32>, normal: vec3<f32>) -> vec3<f32> {
    var out: LightSum;
    for (var ix = 0u; ix < levels.n_levels && out.weight < 1.0; ix++) {
        let level = levels.levels[ix];
        let point = grid_from_world(level.grid, position);
        let is_last = ix + 1u == levels.n_levels;
        let share = (1.0 - out.weight) * select(level_weight(level.grid, point), 1.0, is_last);
        if share > 0.0 {
            let found = light_in_level(level, point, normal);
            if found.weight > 0.0 {
                out = add_share(out, found, share);
            }
        }
    }
    return out.irradiance;
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let record = group_of_dispatch(group) * WORKGROUP + local;
    let level = levels.levels[info.level];
    let n_faces = level.grid.n_faces;
    if record >= counts.x * n_faces {
        return;
    }
    let packed_cell = structure[slot_word(level, record / n_faces)].x;
    let known = before[level.first_record + record];
    let hash = pcg3d(vec3<u32>(packed_cell, record % n_faces + 8u * info.level, info.seed));
    let is_dark = all(known.direct + known.indirect == vec3<f32>(0.0));
    let is_known = min(known.n_rays, info.light_rays) >= IDLE_AFTER;
    if is_dark && is_known && (info.frame + hash.x) % IDLE_PERIOD != 0u {
        after[level.first_record + record] = known;
        return;
    }
    var samples: FaceSamples;
    for (var point = 0u; point < info.n_points; point++) {
        let sample_ix = info.frame * info.n_points + point;
        samples = add_sample(samples, level, packed_cell, record % n_faces, sample_ix, hash);
    }
    after[level.first_record + record] = renew(known, samples, info.light_rays, info.max_rays);
}

/// Draws one point of a face and adds what light it receives.
fn add_sample(
    samples_before: FaceSamples,
    level: VoxelLevel,
    packed_cell: u32,
    record_face: u32,
    sample_ix: u32,
    hash: vec3<u32>,
) -> FaceSamples {
    var samples = samples_before;
    samples.n_rays += 1.0;
    // A cell without faces is looked at from its six sides in turn.
    let face = select(record_face, (sample_ix + hash.x) % 6u, level.grid.n_faces == 1u);
    let axis = face_axis(face);
    let outward = face_normal(face);
    let place = sobol_owen(sample_ix, hash.x);
    var start = vec3<f32>(0.5);
    start[(axis + 1u) % 3u] = place.x;
    start[(axis + 2u) % 3u] = place.y;
    start += outward * (0.5 + BORDER);
    let origin = world_from_grid(level.grid, vec3<f32>(unpack_cell(packed_cell)) + start);
    let hit = nearest_hit(Ray(origin, 0.0, -outward, level.grid.cell * (1.0 + 2.0 * BORDER)));
    if hit_is_miss(hit) {
        return samples;
    }
    let found = surface_at(hit.triangle, hit.barycentrics);
    let is_back = dot(found.geometric_normal, outward) < 0.0 && !found.double_sided;
    if is_back && level.grid.n_faces == 1u {
        // One value serves both sides of a sheet: that of its front.
        return samples;
    }
    let surface = seen_from(found, -outward);

    // The bounce first: it may show that the point is shut in.
    let local = sample_cosine_hemisphere(sobol_owen(sample_ix, hash.y));
    let direction = frame_from_normal(surface.shading_normal) * local;
    let pdf = local.z * INV_PI;
    var direct = vec3<f32>(0.0);
    var indirect = vec3<f32>(0.0);
    if dot(direction, surface.geometric_normal) > 0.0 {
        let from_here = leave(surface, direction);
        let far = nearest_hit(Ray(from_here, 0.0, direction, FLOAT_MAX));
        if hit_is_miss(far) {
            direct = PI * power_heuristic(pdf, pdf_of_sky(direction)) * sky_radiance(direction);
        } else {
            let there = surface_at(far.triangle, far.barycentrics);
            let from_behind = dot(there.geometric_normal, direction) > 0.0;
            if from_behind && !there.double_sided && far.t < SHUT_IN_CELLS * level.grid.cell {
                return samples;
            }
            let met = seen_from(there, direction);
            if any(met.emission > vec3<f32>(0.0)) {
                let light_pdf = pdf_of_emitter(far.triangle, direction, far.t);
                direct = PI * power_heuristic(pdf, light_pdf) * met.emission;
            }
            indirect = reflected_light(met, direction);
        }
    }
    let choice = random_vec4(hash.yz, sample_ix, 0u).xw;
    direct += drawn_light(surface, vec4<f32>(choice.x, sobol_owen(sample_ix, hash.z), choice.y));
    samples.n_hits += 1.0;
    samples.depth += hit.t / level.grid.cell - BORDER;
    if all_finite(direct) && all_finite(indirect) {
        samples.direct += direct;
        samples.indirect += indirect;
    } else {
        samples.n_rejected += 1u;
    }
    return samples;
}

/// A point off the surface, to trace a ray along `direction` from.
fn leave(surface: Surface, direction: vec3<f32>) -> vec3<f32> {
    return offset_ray_origin(
        surface.position,
        surface.position_error,
        surface.geometric_normal,
        direction,
    );
}

/// Irradiance by one drawn light [W·m⁻²], weighed against the chance that a cosine-distributed ray finds
/// it.
fn drawn_light(surface: Surface, u: vec4<f32>) -> vec3<f32> {
    let light = sample_light(surface.position, u);
    let cosine = dot(light.direction, surface.shading_normal);
    let irradiance = light.weight * max(cosine, 0.0);
    let is_below = dot(light.direction, surface.geometric_normal) <= 0.0;
    if is_below || !any(irradiance > vec3<f32>(0.0)) {
        return select(irradiance, vec3<f32>(0.0), all_finite(irradiance));
    }
    if any_hit(ray_to_light(light, leave(surface, light.direction))) {
        return vec3<f32>(0.0);
    }
    return irradiance * select(power_heuristic(light.pdf, cosine * INV_PI), 1.0, light.pdf == 0.0);
}

/// What a surface that a ray met sends back along it: π · radiance [W·m⁻²], from the irradiance that the
/// cache held there. (An estimate of irradiance by a cosine-distributed direction: the cosine cancels
/// with its density.) `met`: as the ray sees it.
fn reflected_light(met: Surface, direction: vec3<f32>) -> vec3<f32> {
    var albedo = met.base_color;
    if !met.lambert {
        let material = metallic_roughness(met.base_color, met.metallic, met.roughness);
        albedo = directional_albedo(material, abs(dot(direction, met.shading_normal)));
    }
    return albedo * cached_irradiance(met.position, met.shading_normal);
}
