// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light that a voxel's face receives, estimated by a few rays.
//!
//! A ray along the face's axis, through a random point of the face, finds a surface point within the cell. From there a
//! cosine-distributed ray is traced: the surface that it hits reflects the irradiance that the cache stored there in
//! the previous frame, so each frame adds a bounce; and it may emit light itself. If the number of bounces is limited,
//! the path continues instead, and gathers only direct light at each of its hits. A shadow ray to a sampled light
//! estimates the direct irradiance as well, and both estimates of it are combined by multiple importance sampling (E.
//! Veach, L. Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering", SIGGRAPH 1995, power
//! heuristic).
//!
//! Bindings: none of its own; it uses the scene seam and `fields::voxel_light`.
#define_import_path lucerna::integrators::face_gather

#import lucerna::bsdf::directional_albedo::directional_albedo
#import lucerna::bsdf::metallic_roughness::metallic_roughness
#import lucerna::components::voxel_light::cache::FaceSamples
#import lucerna::components::voxel_light::face_point::{FACE_RAY_LENGTH, depth_below_face, face_point}
#import lucerna::components::voxel_light::sides::{NO_BORDER, SIDE_OFFSET, is_before_border}
#import lucerna::components::voxels::grid::{VoxelGrid, face_normal, grid_from_world, unpack_cell, world_from_grid}
#import lucerna::fields::voxel_light::{LOOKUP_VALID, irradiance_at}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::integrators::face_sides::{Layer, MAX_LAYERS, next_layer}
#import lucerna::integrators::next_event::irradiance_of_sample
#import lucerna::math::constants::{FLOAT_MAX, INV_PI, PI}
#import lucerna::math::float::all_finite
#import lucerna::math::frame::frame_from_normal
#import lucerna::sampling::hemisphere::sample_cosine_hemisphere
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::mis::{power_heuristic, solid_angle_of_sample}
#import lucerna::sampling::pcg::{pcg, random_vec4}
#import lucerna::scene::lights::{pdf_of_emitter, pdf_of_sky, sample_light}
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::sky::sky_radiance
#import lucerna::scene::surface::surface_at
#import lucerna::scene::visibility::light_visibility
#import lucerna::scene::types::{Ray, hit_is_miss, Surface, seen_from}

/// If a bounce hits the back of a single-sided surface within this many cells, the point is enclosed: it is inside
/// something solid, or behind the foot of a wall, where it is never seen.
const SHUT_IN_CELLS: f32 = 1.5;

/// What to gather.
struct FaceGatherSettings {
    /// Reflections that a path follows. If the field holds only direct light, these are all bounces; otherwise 1 is
    /// enough. 0: none.
    n_bounces: u32,
    /// Whether a light is sampled for the point as well.
    finds_direct: bool,
    /// Only points in front of it count (`lucerna::components::voxel_light::sides`).
    border: u32,
}

/// The state of a path.
struct FacePath {
    at: Surface,
    /// Direction in which it continues.
    direction: vec3<f32>,
    /// Product of the albedos along it.
    throughput: vec3<f32>,
}

/// Samples one point of a face and adds the light that it receives.
///
/// `packed_cell`: that of the voxel (`grid::pack_cell`); `record_face`: 0 to 5, or 0 in a grid with one value per cell.
/// `sample_ix`: counts the face's points; `hash`: the face's own random bits, the same for all its points.
fn add_face_sample(
    samples_before: FaceSamples,
    settings: FaceGatherSettings,
    grid: VoxelGrid,
    packed_cell: u32,
    record_face: u32,
    sample_ix: u32,
    hash: vec3<u32>,
) -> FaceSamples {
    var samples = samples_before;
    samples.n_rays += 1.0;
    // A cell without faces is sampled from its six sides in turn.
    let face = select(record_face, (sample_ix + hash.x) % 6u, grid.n_faces == 1u);
    let outward = face_normal(face);
    let start = face_point(vec3<f32>(unpack_cell(packed_cell)), face, sobol_owen(sample_ix, hash.x));
    // The first surface that is on the record's side.
    var layer: Layer;
    layer.origin = world_from_grid(grid, start);
    layer.length = grid.cell * FACE_RAY_LENGTH;
    let n_layers = select(MAX_LAYERS, 1u, settings.border == NO_BORDER);
    var is_found = false;
    for (var ix = 0u; ix < n_layers && !is_found; ix++) {
        layer = next_layer(layer.origin, outward, layer.length);
        if !layer.is_surface {
            return samples;
        }
        let seen = seen_from(layer.surface, -outward);
        let at = grid_from_world(grid, seen.position) + SIDE_OFFSET * seen.geometric_normal;
        is_found = is_before_border(settings.border, at - vec3<f32>(unpack_cell(packed_cell)));
    }
    if !is_found {
        return samples;
    }
    let found = layer.surface;
    let is_back = dot(found.geometric_normal, outward) < 0.0 && !found.double_sided;
    if is_back && grid.n_faces == 1u {
        // One value is used for both sides of a sheet: that of its front.
        return samples;
    }
    let surface = seen_from(found, -outward);

    // The bounce comes first, because it may show that the point is enclosed.
    var path = FacePath(surface, vec3<f32>(0.0), vec3<f32>(1.0));
    var direct = vec3<f32>(0.0);
    var indirect = vec3<f32>(0.0);
    // (Without reflections, one ray finds emitters and the sky, and enclosed points.)
    for (var bounce = 0u; bounce < max(settings.n_bounces, 1u); bounce++) {
        let seed = select(pcg(hash.y + bounce), hash.y, bounce == 0u);
        let local = sample_cosine_hemisphere(sobol_owen(sample_ix, seed));
        path.direction = frame_from_normal(path.at.shading_normal) * local;
        if dot(path.direction, path.at.geometric_normal) <= 0.0 {
            break;
        }
        let from_here = offset_ray_origin(
            path.at.position,
            path.at.position_error,
            path.at.geometric_normal,
            path.direction,
        );
        let far = nearest_hit(Ray(from_here, 0.0, path.direction, FLOAT_MAX));
        let pdf = local.z * INV_PI;
        if hit_is_miss(far) {
            // (Farther along, the sky is part of the direct light at the hits.)
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
            if from_behind && !there.double_sided && far.t < SHUT_IN_CELLS * grid.cell {
                return samples;
            }
            if any(met.emission > vec3<f32>(0.0)) {
                let light_pdf = pdf_of_emitter(far.triangle, path.direction, far.t);
                direct = PI * power_heuristic(pdf, light_pdf) * met.emission;
            }
        }
        if settings.n_bounces == 0u {
            break;
        }
        path.throughput *= albedo_towards(met, -path.direction);
        indirect += path.throughput * irradiance_at(met.position, met.shading_normal, LOOKUP_VALID);
        path.at = met;
    }
    if settings.finds_direct {
        let choice = random_vec4(hash.yz, sample_ix, 0u).xw;
        let place_on_light = sobol_owen(sample_ix, hash.z);
        direct += visible_irradiance(surface, vec4<f32>(choice.x, place_on_light, choice.y));
    }
    samples.n_hits += 1.0;
    samples.depth += depth_below_face(dot(world_from_grid(grid, start) - surface.position, outward) / grid.cell);
    if all_finite(direct) && all_finite(indirect) {
        samples.direct += direct;
        samples.indirect += indirect;
    } else {
        samples.n_rejected += 1u;
    }
    return samples;
}

/// Irradiance by one sampled light [W·m⁻²], weighted against the chance that a cosine-distributed ray finds it, with
/// shadows by `scene::visibility`. `u`: uniform in [0, 1)⁴.
fn visible_irradiance(surface: Surface, u: vec4<f32>) -> vec3<f32> {
    let light = sample_light(surface.position, u);
    let found = irradiance_of_sample(surface, light);
    if !found.may_arrive {
        return found.light;
    }
    let visible = light_visibility(
        light,
        surface.position,
        surface.position_error,
        surface.geometric_normal,
        solid_angle_of_sample(light.pdf),
    );
    if visible == 0.0 {
        return vec3<f32>(0.0);
    }
    return visible * found.light * found.weight;
}

/// The share of the irradiance on a surface that it reflects towards a direction (unit length, away from it), as π ·
/// radiance / irradiance, in [0, 1]. (A surface with irradiance E that a cosine-distributed ray hits adds this · E to
/// the irradiance where the ray started, because the cosine cancels with the density.)
fn albedo_towards(surface: Surface, direction: vec3<f32>) -> vec3<f32> {
    if surface.lambert {
        return surface.base_color;
    }
    let material = metallic_roughness(surface.base_color, surface.metallic, surface.roughness);
    return directional_albedo(material, abs(dot(direction, surface.shading_normal)));
}
