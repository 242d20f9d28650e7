// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: rays from surface to surface through voxels, each face of which has a surfel and its light.
//!
//! Interface: `surfels`, `trace_surfels`. The light is that of `fields::voxel_light_texels`: what the host binds as `face_light`.
#define_import_path lucerna::fields::voxel_surfels

#import lucerna::components::voxel_light::sides::{NO_BORDER, SIDE_OFFSET, border_normal, is_before_border}
#import lucerna::components::voxel_surfels::surfel::{SIDE_FRONT, SIDE_UNKNOWN, START_REACH, Surfel, height_over_surfel, meet_surfel}
#import lucerna::components::voxel_surfels::surfel::{side_at_start, surfel_is_seen}
#import lucerna::components::voxel_surfels::surfel::unpack_surfel
#import lucerna::components::voxels::bricks::{BRICK, NO_SLOT, brick_of_cell, slot_in_brick}
#import lucerna::components::voxels::grid::grid_from_world
#import lucerna::components::voxels::levels::VoxelLevel
#import lucerna::components::voxels::walk::{GridRay, GridStep, grid_point, grid_ray, step_out_of}
#import lucerna::fields::voxel_light_texels::{face_light, levels}
#import lucerna::fields::voxel_structure::{border_of_record, structure}
#import lucerna::math::constants::INV_PI
#import lucerna::math::float::all_finite

/// As `face_light`: for each level, slot · 6 + face, then second records (`lucerna::components::voxel_surfels::surfel`).
@group(3) @binding(21) var<storage, read> surfels: array<vec4<u32>>;

/// The most cells and blocks that a ray goes through; those of 6 levels of 256 are 4608 at most.
const MAX_WALK: u32 = 5000u;
/// A ray ends when this share of it is left.
const LEAST_TRANSMITTANCE: f32 = 0.05;

/// What is darker than this share of what is in front of it, and only partly hides it, is inside of it.
const OTHER_SIDE: f32 = 0.01;
/// A surfel reaches this far beyond its border [cells], more than borders are rounded by, so that corners are closed.
const BORDER_SLACK: f32 = 0.02;

/// What a ray finds.
struct SurfelLight {
    /// [W·sr⁻¹·m⁻²]
    radiance: vec3<f32>,
    /// Share of the ray that met nothing, in [0, 1].
    transmittance: f32,
    /// The same, within the distance `near`.
    near_transmittance: f32,
    n_steps: u32,
}

/// Where a ray meets the surfels of a cell, for each axis.
struct CellMeetings {
    /// From 0 (entering the cell) to 1 (leaving); −1: not.
    shares: vec3<f32>,
    opacities: vec3<f32>,
    /// Radiance towards the ray [W·sr⁻¹·m⁻²].
    radiances: mat3x3<f32>,
}

/// What the surface of a record reflects [W·sr⁻¹·m⁻²].
fn radiance_of_record(level: VoxelLevel, record: u32, albedo: vec3<f32>) -> vec3<f32> {
    let radiance = albedo * INV_PI * face_light[level.first_record + record].rgb;
    return select(vec3<f32>(0.0), max(radiance, vec3<f32>(0.0)), all_finite(radiance));
}

/// Whether a ray meets a surfel's plane before its border. `enters`, `leaves`: where it enters and leaves the cell, from its corner
/// [cells].
fn is_within_border(surfel: Surfel, enters: vec3<f32>, leaves: vec3<f32>) -> bool {
    let border = surfel.border;
    if border == NO_BORDER {
        return true;
    }
    let high = height_over_surfel(surfel, enters);
    let low = height_over_surfel(surfel, leaves);
    let met = mix(enters, leaves, clamp(high / max(high - low, 1e-6), 0.0, 1.0));
    return is_before_border(border, met + BORDER_SLACK * border_normal(border));
}

/// Follows a ray through a cell in which there are surfaces. `sides`: for each axis the side of its surface on which the ray is.
/// `t`: where it enters and leaves [cells]; `start_normal`: unit normal of the surface where it starts, zeros if it started in a finer level.
fn meet_cell(
    level: VoxelLevel,
    slot: u32,
    cell: vec3<f32>,
    ray: GridRay,
    t: vec2<f32>,
    sides: ptr<function, vec3<u32>>,
    start_normal: vec3<f32>,
) -> CellMeetings {
    var out = CellMeetings(vec3<f32>(-1.0), vec3<f32>(0.0), mat3x3<f32>());
    let enters = grid_point(ray, t.x) - cell;
    let leaves = grid_point(ray, t.y) - cell;
    for (var axis = 0u; axis < 3u; axis++) {
        let side = (*sides)[axis];
        (*sides)[axis] = SIDE_UNKNOWN;
        // The face that the ray sees.
        var record = slot * level.grid.n_faces + 2u * axis + u32(ray.direction[axis] > 0.0);
        let words = surfels[level.first_record + record];
        if !surfel_is_seen(words) {
            continue;
        }
        var surfel = unpack_surfel(words);
        if !is_within_border(surfel, enters, leaves) {
            let other = border_of_record(level, record).y;
            if other == 0u {
                continue;
            }
            record = other - 1u;
            surfel = unpack_surfel(surfels[level.first_record + record]);
            if surfel.opacity == 0.0 || !is_within_border(surfel, enters, leaves) {
                continue;
            }
        }
        if dot(surfel.normal, ray.direction) >= 0.0 {
            continue;
        }
        var before = side;
        if before != SIDE_FRONT && t.x < START_REACH && any(start_normal != vec3<f32>(0.0)) {
            let height = height_over_surfel(surfel, ray.origin - cell);
            before = side_at_start(height, dot(surfel.normal, start_normal));
        }
        let meeting = meet_surfel(before, height_over_surfel(surfel, enters), height_over_surfel(surfel, leaves));
        (*sides)[axis] = meeting.side;
        if meeting.share >= 0.0 {
            out.shares[axis] = meeting.share;
            out.opacities[axis] = surfel.opacity;
            out.radiances[axis] = radiance_of_record(level, record, surfel.albedo);
        }
    }
    return out;
}

/// The axis whose meeting is the next one, or 3.
fn next_meeting(shares: vec3<f32>) -> u32 {
    var best = 3u;
    var least = 2.0;
    for (var axis = 0u; axis < 3u; axis++) {
        if shares[axis] >= 0.0 && shares[axis] < least {
            least = shares[axis];
            best = axis;
        }
    }
    return best;
}

/// Whether a surface is so much darker than what the ray has come through by half that it is on the other side of it: what is
/// lit lights what it sees.
fn is_much_darker(radiance: vec3<f32>, found: SurfelLight) -> bool {
    let before = max(found.radiance.x, max(found.radiance.y, found.radiance.z));
    let here = max(radiance.x, max(radiance.y, radiance.z));
    return here * (1.0 - found.transmittance) < OTHER_SIDE * before;
}

/// The result of a ray that ends: the rest is assumed to be like what was found.
fn end_of_ray(found: SurfelLight) -> SurfelLight {
    var out = found;
    out.radiance /= 1.0 - out.transmittance;
    out.near_transmittance = max(out.near_transmittance - out.transmittance, 0.0) / (1.0 - out.transmittance);
    out.transmittance = 0.0;
    return out;
}

/// Follows a ray to the first surface that hides what is behind it.
///
/// `origin`: on a surface of unit normal `normal`, or a little in front of it [m]; zeros: in the air. `direction`: unit
/// length. `max_distance`: where it ends at the latest; `near`: the distance of `near_transmittance` [m].
fn trace_surfels(
    origin: vec3<f32>,
    normal: vec3<f32>,
    direction: vec3<f32>,
    max_distance: f32,
    near: f32,
) -> SurfelLight {
    var out = SurfelLight(vec3<f32>(0.0), 1.0, 1.0, 0u);
    // Up to where it was followed in finer levels [m].
    var done = 0.0;
    for (var ix = 0u; ix < levels.n_levels; ix++) {
        let level = levels.levels[ix];
        // (A point on the border between two cells belongs to the one in front of its surface.)
        let ray = grid_ray(grid_from_world(level.grid, origin) + SIDE_OFFSET * normal, direction);
        let end = max_distance / level.grid.cell;
        let size = vec3<i32>(level.grid.size);
        let from_finer = done / level.grid.cell;
        var at = GridStep(vec3<i32>(floor(grid_point(ray, from_finer))), from_finer);
        let start_normal = select(vec3<f32>(0.0), normal, done == 0.0);
        var sides = vec3<u32>(SIDE_UNKNOWN);
        while out.n_steps < MAX_WALK && at.t < end && all(at.cell >= vec3<i32>(0)) && all(at.cell < size) {
            out.n_steps += 1u;
            let cell = vec3<u32>(at.cell);
            let brick = structure[level.first_brick + brick_of_cell(level.grid, cell)];
            if brick.x == 0u {
                let low = vec3<i32>(cell / BRICK * BRICK);
                at = step_out_of(ray, low, low + vec3<i32>(BRICK), at.t);
                sides = vec3<u32>(SIDE_UNKNOWN);
                continue;
            }
            let next = step_out_of(ray, at.cell, at.cell + 1, at.t);
            let slot = slot_in_brick(brick, cell);
            if slot == NO_SLOT {
                sides = vec3<u32>(SIDE_UNKNOWN);
            } else {
                let t = vec2<f32>(at.t, next.t);
                var meetings = meet_cell(level, slot, vec3<f32>(cell), ray, t, &sides, start_normal);
                for (var axis = next_meeting(meetings.shares); axis < 3u; axis = next_meeting(meetings.shares)) {
                    let distance = mix(at.t, next.t, meetings.shares[axis]);
                    if distance > end {
                        break;
                    }
                    if is_much_darker(meetings.radiances[axis], out) {
                        return end_of_ray(out);
                    }
                    meetings.shares[axis] = -1.0;
                    let opacity = meetings.opacities[axis];
                    if distance * level.grid.cell < near {
                        out.near_transmittance *= 1.0 - opacity;
                    }
                    out.radiance += out.transmittance * opacity * meetings.radiances[axis];
                    out.transmittance *= 1.0 - opacity;
                }
                if out.transmittance < LEAST_TRANSMITTANCE {
                    return end_of_ray(out);
                }
            }
            at = next;
        }
        done = max(at.t * level.grid.cell, done);
    }
    return out;
}
