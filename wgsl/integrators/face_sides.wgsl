// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a voxel's face sees of its cell, in groups of places that see each other
//! (`lucerna::components::voxel_light::sides`).
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::face_sides

#import lucerna::components::voxel_light::face_point::{FACE_RAY_LENGTH, face_point}
#import lucerna::components::voxel_light::sides::{NO_BORDER, NO_PLACE, pack_border, pack_place, unpack_place}
#import lucerna::components::voxels::grid::{VoxelGrid, face_normal, grid_from_world, unpack_cell, world_from_grid}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::scene::rays::{any_hit, nearest_hit}
#import lucerna::scene::surface::surface_at
#import lucerna::scene::types::{Ray, hit_is_miss, seen_from}

/// Rays along the face's axis.
const N_PROBES: u32 = 16u;
/// A place is half as high above its surface as there is room, and at most this high [cells].
const HEIGHT: f32 = 0.1;

/// What a face sees: places in front of its surfaces, from the cell's corner [cells].
struct Seen {
    places: array<vec3<f32>, N_PROBES>,
    n: u32,
}

/// Looks into a cell from a face along its axis.
fn look_into(grid: VoxelGrid, packed_cell: u32, face: u32) -> Seen {
    let cell = vec3<f32>(unpack_cell(packed_cell));
    let outward = face_normal(face);
    let seed = pcg(packed_cell + pcg(face));
    var seen: Seen;
    for (var probe = 0u; probe < N_PROBES; probe++) {
        let origin = world_from_grid(grid, face_point(cell, face, sobol_owen(probe, seed)));
        let hit = nearest_hit(Ray(origin, 0.0, -outward, grid.cell * FACE_RAY_LENGTH));
        if hit_is_miss(hit) {
            continue;
        }
        let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), -outward);
        let normal = surface.geometric_normal;
        let start = offset_ray_origin(surface.position, surface.position_error, normal, normal);
        let room = 2.0 * HEIGHT * grid.cell;
        let above = nearest_hit(Ray(start, 0.0, normal, room));
        let height = 0.5 * select(above.t, room, hit_is_miss(above));
        seen.places[seen.n] = grid_from_world(grid, start + height * normal) - cell;
        seen.n += 1u;
    }
    return seen;
}

/// The ray between two places of cells [cells from the grid's corner], from the first one.
fn ray_between(grid: VoxelGrid, a: vec3<f32>, b: vec3<f32>) -> Ray {
    let distance = length(b - a);
    let direction = (b - a) / max(distance, 1e-6);
    return Ray(world_from_grid(grid, a), 0.0, direction, distance * grid.cell);
}

/// Whether nothing stands between two places of cells [cells from the grid's corner].
fn see_each_other(grid: VoxelGrid, a: vec3<f32>, b: vec3<f32>) -> bool {
    return !any_hit(ray_between(grid, a, b));
}

/// The number of the group of each place, 1 and more: what is visible from the group's first place.
fn groups_of(grid: VoxelGrid, cell: vec3<f32>, seen: ptr<function, Seen>) -> array<u32, N_PROBES> {
    var groups: array<u32, N_PROBES>;
    var n_groups = 0u;
    for (var ix = 0u; ix < (*seen).n; ix++) {
        if groups[ix] != 0u {
            continue;
        }
        n_groups += 1u;
        groups[ix] = n_groups;
        for (var other = ix + 1u; other < (*seen).n; other++) {
            if groups[other] == 0u
                && see_each_other(grid, cell + (*seen).places[ix], cell + (*seen).places[other]) {
                groups[other] = n_groups;
            }
        }
    }
    return groups;
}

/// The group with the most places except for one, or 0.
fn largest_group(n: u32, groups: array<u32, N_PROBES>, except_for: u32) -> u32 {
    var sizes: array<u32, N_PROBES + 1u>;
    for (var ix = 0u; ix < n; ix++) {
        sizes[groups[ix]] += 1u;
    }
    var best = 0u;
    for (var group = 1u; group <= N_PROBES; group++) {
        if group != except_for && sizes[group] > select(0u, sizes[best], best != 0u) {
            best = group;
        }
    }
    return best;
}

/// The place of a group that is nearest to its middle, packed.
fn place_of_group(seen: ptr<function, Seen>, groups: array<u32, N_PROBES>, group: u32) -> u32 {
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < (*seen).n; ix++) {
        if groups[ix] == group {
            sum += vec4<f32>((*seen).places[ix], 1.0);
        }
    }
    var best = NO_PLACE;
    var least = 1e9;
    for (var ix = 0u; ix < (*seen).n; ix++) {
        let away = length((*seen).places[ix] - sum.xyz / sum.w);
        if groups[ix] == group && away < least {
            least = away;
            best = pack_place((*seen).places[ix]);
        }
    }
    return best;
}

/// The plane of the first surface from one place to another, towards the first one, packed; NO_BORDER if there is none.
fn border_between(grid: VoxelGrid, cell: vec3<f32>, a: u32, b: u32) -> u32 {
    let ray = ray_between(grid, cell + unpack_place(a), cell + unpack_place(b));
    let hit = nearest_hit(ray);
    if hit_is_miss(hit) {
        return NO_BORDER;
    }
    let surface = seen_from(surface_at(hit.triangle, hit.barycentrics), ray.direction);
    return pack_border(surface.geometric_normal, grid_from_world(grid, surface.position) - cell);
}
