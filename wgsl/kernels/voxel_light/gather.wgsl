// SPDX-License-Identifier: MIT OR Apache-2.0
//! Renews the irradiance of every face of every occupied voxel by a few rays.
//!
//! A ray along the face's axis, through a random point of the face, finds a surface point within the
//! cell. From there a cosine-distributed ray is traced: what it meets reflects the irradiance that the
//! cache held there in the frame before, so each frame adds a bounce; and what it meets emits. Where
//! bounces are counted, the path goes on instead, and gathers direct light alone at each of its hits. A
//! shadow ray to a drawn light estimates the direct irradiance as well, and both estimates of it are
//! combined by multiple importance sampling (E. Veach, L. Guibas, "Optimally Combining Sampling
//! Techniques for Monte Carlo Rendering", SIGGRAPH 1995, power heuristic).
//!
//! Dispatch: indirect, one invocation a record (slot · n_faces + face), in rows as
//! `lucerna::math::dispatch` lays them out. Workgroup memory: none. Each invocation owns one record of
//! `lights`; of others it reads what the kernel voxel_light/publish made of them: the same input gives the
//! same bytes.

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::fields::voxel_light::{LOOKUP_VALID, irradiance_at, levels, structure}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::scene::lights::{pdf_of_emitter, pdf_of_sky, sample_light}
#import lucerna::scene::rays::{Ray, nearest_hit, hit_is_miss}
#import lucerna::scene::sky::sky_radiance
#import lucerna::scene::surface::{Surface, seen_from, surface_at}
#import lucerna::scene::visibility::light_visibility
#import lucerna::math::constants::{FLOAT_MAX, INV_PI, PI}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::math::float::all_finite
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::loops::loops_run
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::mis::power_heuristic
#import lucerna::sampling::pcg::{pcg, pcg3d, random_vec4}
#import lucerna::components::voxels::grid::{face_axis, face_normal, unpack_cell, world_from_grid}
#import lucerna::components::voxels::levels::{VoxelLevel, slot_word}
#import lucerna::components::voxel_light::cache::{FaceLight, FaceSamples, WALL_COSINE, is_lit, keep_deposits, renew, with_cut}

const WORKGROUP: u32 = 64u;
/// Rays along the axis start so far before the face and end so far behind the opposite one [cells]:
/// a surface on the border between two cells belongs to both.
const BORDER: f32 = 1e-3;
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
    /// Reflections that a path follows. With `face_light` holding direct light alone, these
    /// are all that is counted; else 1 is enough. 0: something else renews reflected light, which stays as it is.
    n_bounces: u32,
    /// See `cache::renew`.
    light_rays: f32,
    max_rays: f32,
    /// Index of the level whose faces are renewed.
    level: u32,
    /// 1: direct light is found here. 0: it stays as it is, for something else deposits it.
    finds_direct: u32,
}

@group(1) @binding(0) var<uniform> info: GatherInfo;
/// x: occupied voxels of the level.
@group(1) @binding(1) var<uniform> counts: vec4<u32>;
@group(1) @binding(2) var<storage, read_write> lights: array<FaceLight>;

/// Where a path stands.
struct Path {
    at: Surface,
    /// In which it goes on.
    direction: vec3<f32>,
    /// Product of the albedos that it met.
    throughput: vec3<f32>,
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
    let known = lights[level.first_record + record];
    let hash = pcg3d(vec3<u32>(packed_cell, record % n_faces + 8u * info.level, info.seed));
    let is_known = min(known.n_rays, info.light_rays) >= IDLE_AFTER;
    if !is_lit(known) && is_known && (info.frame + hash.x) % IDLE_PERIOD != 0u {
        return;
    }
    var samples: FaceSamples;
    var is_cut = false;
    for (var point = 0u; point < info.n_points; point++) {
        let sample_ix = info.frame * info.n_points + point;
        let more = add_sample(samples, level, packed_cell, record % n_faces, sample_ix, hash);
        // (No index of a level has the top bit.)
        if !loops_run(info.level >> 31u) {
            is_cut = true;
            break;
        }
        samples = more;
    }
    var renewed = renew(known, samples, info.light_rays, info.max_rays);
    if info.finds_direct == 0u {
        renewed = keep_deposits(renewed, known);
    }
    if info.n_bounces == 0u {
        renewed.indirect = known.indirect;
        renewed.feedback = known.feedback;
    }
    if is_cut {
        renewed = with_cut(renewed);
    }
    lights[level.first_record + record] = renewed;
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
    var path = Path(surface, vec3<f32>(0.0), vec3<f32>(1.0));
    var direct = vec3<f32>(0.0);
    var indirect = vec3<f32>(0.0);
    // (Without reflections, one ray finds emitters and the sky, and what is shut in.)
    for (var bounce = 0u; bounce < max(info.n_bounces, 1u); bounce++) {
        let seed = select(pcg(hash.y + bounce), hash.y, bounce == 0u);
        let local = sample_cosine_hemisphere(sobol_owen(sample_ix, seed));
        path.direction = frame_from_normal(path.at.shading_normal) * local;
        if dot(path.direction, path.at.geometric_normal) <= 0.0 {
            break;
        }
        let from_here = leave(path.at, path.direction);
        let far = nearest_hit(Ray(from_here, 0.0, path.direction, FLOAT_MAX));
        let pdf = local.z * INV_PI;
        if hit_is_miss(far) {
            // (Farther along, the sky is among the direct light of what was met.)
            if bounce == 0u {
                let light_pdf = pdf_of_sky(path.direction);
                direct = PI * power_heuristic(pdf, light_pdf) * sky_radiance(path.direction);
            }
            break;
        }
        let there = surface_at(far.triangle, far.barycentrics);
        let met = seen_from(there, path.direction);
        if bounce == 0u {
            let from_behind = dot(there.geometric_normal, path.direction) > 0.0;
            if from_behind && !there.double_sided && far.t < SHUT_IN_CELLS * level.grid.cell {
                return samples;
            }
            if any(met.emission > vec3<f32>(0.0)) {
                let light_pdf = pdf_of_emitter(far.triangle, path.direction, far.t);
                direct = PI * power_heuristic(pdf, light_pdf) * met.emission;
            }
        }
        if info.n_bounces == 0u {
            break;
        }
        path.throughput *= albedo_towards(met, -path.direction);
        indirect += path.throughput * irradiance_at(met.position, met.shading_normal, LOOKUP_VALID);
        path.at = met;
    }
    if info.finds_direct != 0u {
        let choice = random_vec4(hash.yz, sample_ix, 0u).xw;
        let place_on_light = sobol_owen(sample_ix, hash.z);
        direct += drawn_light(surface, vec4<f32>(choice.x, place_on_light, choice.y));
    }
    samples.n_hits += 1.0;
    samples.depth += hit.t / level.grid.cell - BORDER;
    samples.n_wall_hits += select(0.0, 1.0, abs(dot(found.geometric_normal, outward)) >= WALL_COSINE);
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
    let visible = light_visibility(
        light,
        surface.position,
        surface.position_error,
        surface.geometric_normal,
        select(0.0, 1.0 / light.pdf, light.pdf > 0.0),
    );
    if visible == 0.0 {
        return vec3<f32>(0.0);
    }
    return visible * irradiance * select(power_heuristic(light.pdf, cosine * INV_PI), 1.0, light.pdf == 0.0);
}

/// The share of the irradiance on a surface that it reflects towards a direction, as π · radiance / irradiance.
/// (What a cosine-distributed ray meets with irradiance E adds this · E to the irradiance where it
/// began: the cosine cancels with the density.)
fn albedo_towards(surface: Surface, direction: vec3<f32>) -> vec3<f32> {
    if surface.lambert {
        return surface.base_color;
    }
    let material = metallic_roughness(surface.base_color, surface.metallic, surface.roughness);
    return directional_albedo(material, abs(dot(direction, surface.shading_normal)));
}
