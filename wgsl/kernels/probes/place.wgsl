// SPDX-License-Identifier: MIT OR Apache-2.0
//! Moves probes away from surfaces that are very near, and marks those that are inside something.
//!
//! Rays in 256 directions look for surfaces. If many end at backs of single-sided surfaces, or most of those that meet anything, the probe
//! is inside something or behind a wall. It stays there: moved through the surface, it would stand for light around an edge, of
//! which the points of its corner see nothing. If a surface is nearer than CLEARANCE to any other probe, the probe moves away from it, but not
//! past the middle of a gap, nor out of its part of the lattice (`MOST_MOVED`). After three such steps, whether it is inside something is
//! decided where it is then.
//!
//! Dispatch: indirect, one workgroup a probe, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 1536 bytes. The
//! order of reduction is fixed: the same scene gives the same places.

#import lucerna::components::probes::octahedral_map::MAP_SIDE
#import lucerna::components::probes::place::{MOST_MOVED, pack_move, place_moved}
#import lucerna::components::voxels::grid::{VoxelGrid, unpack_cell, world_from_grid}
#import lucerna::integrators::surroundings::{is_inside_something, surroundings_in_texel}
#import lucerna::math::dispatch::group_of_dispatch
#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, hit_is_miss}

/// One invocation for each texel of an octahedral map.
const WORKGROUP: u32 = 64u;
const_assert WORKGROUP == MAP_SIDE * MAP_SIDE;
/// Rays along each side of a texel.
const RAYS: u32 = 2u;
/// The longest ray [cells].
const MOST: f32 = 2.5;
/// How far away from surfaces probes move [cells].
const CLEARANCE: f32 = 0.2;
const STEPS: u32 = 3u;

struct PlaceInfo {
    /// 1: probes move; 0: they stay at their corners.
    moves: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

struct PlaceCounts {
    /// Probes that are not at their corner.
    n_moved: atomic<u32>,
    /// Probes that are inside something.
    n_inside: atomic<u32>,
}

@group(1) @binding(0) var<uniform> info: PlaceInfo;
@group(1) @binding(1) var<uniform> lattice: VoxelGrid;
/// x: probes.
@group(1) @binding(2) var<storage, read> counts: vec4<u32>;
/// Of the lattice (`lucerna::components::voxels::bricks`); the second word of a probe becomes its place.
@group(1) @binding(3) var<storage, read_write> structure: array<vec2<u32>>;
@group(1) @binding(4) var<storage, read_write> placed: PlaceCounts;

/// xyz: direction; w: distance of the nearest surface [cells].
var<workgroup> nearest: array<vec4<f32>, WORKGROUP>;
/// x: rays that end at backs; y: rays that meet anything.
var<workgroup> n_met: array<vec2<u32>, WORKGROUP>;

/// What one invocation's rays find from a place [cells of the lattice].
fn look(place: vec3<f32>, local: u32) {
    let found = surroundings_in_texel(world_from_grid(lattice, place), local, RAYS, MOST * lattice.cell);
    nearest[local] = vec4<f32>(found.direction, found.distance / lattice.cell);
    n_met[local] = vec2<u32>(found.n_backs, found.n_met);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let probe = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if probe >= counts.x {
        return;
    }
    let at = lattice.bricks.x * lattice.bricks.y * lattice.bricks.z + probe;
    let corner = vec3<f32>(unpack_cell(structure[at].x));
    var moved = vec3<f32>(0.0);
    var is_inside = false;
    for (var step = 0u; step <= STEPS; step++) {
        look(corner + moved, local);
        workgroupBarrier();
        for (var reach = WORKGROUP / 2u; reach > 0u; reach /= 2u) {
            if local < reach {
                n_met[local] += n_met[local + reach];
                if nearest[local + reach].w < nearest[local].w {
                    nearest[local] = nearest[local + reach];
                }
            }
            workgroupBarrier();
        }
        // (The same for all, which the compiler must see.)
        let surface = workgroupUniformLoad(&nearest[0]);
        let met = workgroupUniformLoad(&n_met[0]);
        is_inside = is_inside_something(met.x, met.y, WORKGROUP * RAYS * RAYS);
        // Most probes stay, and need no second look.
        if step == STEPS || info.moves == 0u || is_inside || surface.w >= CLEARANCE {
            break;
        }
        let away = Ray(world_from_grid(lattice, corner + moved), 0.0, -surface.xyz, 2.0 * CLEARANCE * lattice.cell);
        let hit = nearest_hit(away);
        let free = select(hit.t / lattice.cell, 2.0 * CLEARANCE, hit_is_miss(hit));
        let next = moved - surface.xyz * max(min(CLEARANCE - surface.w, 0.5 * (free - surface.w)), 0.0);
        if all(abs(next) <= vec3<f32>(MOST_MOVED)) {
            // (As it is kept.)
            moved = place_moved(pack_move(next, false));
        }
    }
    if local == 0u {
        structure[at].y = pack_move(moved, is_inside);
        if any(moved != vec3<f32>(0.0)) {
            atomicAdd(&placed.n_moved, 1u);
        }
        if is_inside {
            atomicAdd(&placed.n_inside, 1u);
        }
    }
}
