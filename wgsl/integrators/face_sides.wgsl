// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a voxel's face sees of its cell, in groups of places that see each other
//! (`lucerna::components::voxel_light::sides`).
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::face_sides

#import lucerna::components::voxel_light::face_point::{FACE_RAY_LENGTH, face_point}
#import lucerna::components::voxel_light::sides::{NO_BORDER, pack_border, pack_place, unpack_place}
#import lucerna::components::voxels::grid::{VoxelGrid, face_normal, grid_from_world, unpack_cell, world_from_grid}
#import lucerna::geometry::ray_offset::offset_ray_origin
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::scene::rays::{any_hit, nearest_hit}
#import lucerna::scene::surface::surface_at
#import lucerna::math::frame::frame_from_normal
#import lucerna::math::octahedral::{pack_direction, unpack_direction}
#import lucerna::scene::types::{Ray, Surface, hit_is_miss, seen_from}

/// Rays along the face's axis.
const N_PROBES: u32 = 16u;
/// If this many found nothing, there is nothing.
const N_PROBES_OF_NOTHING: u32 = 8u;
/// Surfaces that a ray along the axis finds one behind the other.
const MAX_LAYERS: u32 = 3u;
/// Places that are looked at.
const MAX_PLACES: u32 = 32u;
/// Groups of them that are looked at, the largest first.
const MAX_GROUPS: u32 = 6u;
/// A place is half as high above its surface as there is room, and at most this high [cells]: seen from there, surfaces that
/// bend away within 2 cells or more do not hide what is beside them.
const HEIGHT: f32 = 0.1;
/// A place from which nothing is visible that is farther away than this is enclosed [cells].
const ENCLOSED: f32 = 2.0;

/// What a face sees, and what is behind that: places in front of its surfaces, from the cell's corner [cells].
struct Seen {
    places: array<vec3<f32>, MAX_PLACES>,
    /// The normals of these surfaces on that side (`math::octahedral::pack_direction`).
    normals: array<u32, MAX_PLACES>,
    n: u32,
}

/// A surface that a ray along the axis of a face meets, and the ray beyond it.
struct Layer {
    is_surface: bool,
    surface: Surface,
    /// As in `scene::types::Hit`.
    triangle: u32,
    barycentrics: vec2<f32>,
    /// Where the ray goes on, and how much of it is left [m].
    origin: vec3<f32>,
    length: f32,
}

/// The first surface on a ray against `outward` (unit length), `length` long [m].
fn next_layer(origin: vec3<f32>, outward: vec3<f32>, length: f32) -> Layer {
    var layer: Layer;
    let hit = nearest_hit(Ray(origin, 0.0, -outward, length));
    if hit_is_miss(hit) {
        return layer;
    }
    let found = surface_at(hit.triangle, hit.barycentrics);
    layer.is_surface = true;
    layer.surface = found;
    layer.triangle = hit.triangle;
    layer.barycentrics = hit.barycentrics;
    layer.origin = offset_ray_origin(found.position, found.position_error, found.geometric_normal, -outward);
    layer.length = length - hit.t;
    return layer;
}

/// Looks into a cell from a face along its axis.
fn look_into(grid: VoxelGrid, packed_cell: u32, face: u32) -> Seen {
    let cell = vec3<f32>(unpack_cell(packed_cell));
    let outward = face_normal(face);
    let seed = pcg(packed_cell + pcg(face));
    var seen: Seen;
    for (var probe = 0u; probe < N_PROBES; probe++) {
        if probe == N_PROBES_OF_NOTHING && seen.n == 0u {
            break;
        }
        var layer: Layer;
        layer.origin = world_from_grid(grid, face_point(cell, face, sobol_owen(probe, seed)));
        layer.length = grid.cell * FACE_RAY_LENGTH;
        for (var ix = 0u; ix < MAX_LAYERS && seen.n < MAX_PLACES; ix++) {
            layer = next_layer(layer.origin, outward, layer.length);
            if !layer.is_surface {
                break;
            }
            let surface = seen_from(layer.surface, -outward);
            seen.places[seen.n] = place_above(grid, surface) - cell;
            seen.normals[seen.n] = pack_direction(surface.geometric_normal);
            seen.n += 1u;
        }
    }
    return seen;
}

/// The place above a surface point, in grid units.
fn place_above(grid: VoxelGrid, surface: Surface) -> vec3<f32> {
    let normal = surface.geometric_normal;
    let start = offset_ray_origin(surface.position, surface.position_error, normal, normal);
    // (Inside a thin wall there is little room.)
    let room = 2.0 * HEIGHT * grid.cell;
    let above = nearest_hit(Ray(start, 0.0, normal, room));
    return grid_from_world(grid, start + 0.5 * select(above.t, room, hit_is_miss(above)) * normal);
}

/// Whether a place (in grid units) in front of a surface with this normal (unit length) sees nothing that is far: it is
/// inside something solid, or in a gap that cells are too coarse for.
fn is_enclosed(grid: VoxelGrid, place: vec3<f32>, normal: vec3<f32>) -> bool {
    let basis = frame_from_normal(normal);
    let origin = world_from_grid(grid, place);
    for (var k = 0u; k < 5u; k++) {
        var direction = normal;
        if k > 0u {
            // 45° off the normal.
            let across = select(-1.0, 1.0, (k & 1u) != 0u) * basis[(k - 1u) >> 1u];
            direction = normalize(normal + across);
        }
        if !any_hit(Ray(origin, 0.0, direction, ENCLOSED * grid.cell)) {
            return false;
        }
    }
    return true;
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
fn groups_of(grid: VoxelGrid, cell: vec3<f32>, seen: ptr<function, Seen>) -> array<u32, MAX_PLACES> {
    var groups: array<u32, MAX_PLACES>;
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

/// The group with the most places, or 0. `except_for`: bit k − 1 leaves out group k.
fn largest_group(n: u32, groups: array<u32, MAX_PLACES>, except_for: u32) -> u32 {
    var sizes: array<u32, MAX_PLACES + 1u>;
    for (var ix = 0u; ix < n; ix++) {
        sizes[groups[ix]] += 1u;
    }
    var best = 0u;
    for (var group = 1u; group <= MAX_PLACES; group++) {
        let is_left_out = (except_for & (1u << (group - 1u))) != 0u;
        if !is_left_out && sizes[group] > select(0u, sizes[best], best != 0u) {
            best = group;
        }
    }
    return best;
}

/// Groups by what becomes of them; 0: none.
struct ChosenGroups {
    /// The record's own: the largest that is not enclosed, or the largest.
    own: u32,
    /// The second largest that is not enclosed.
    second: u32,
    /// What the record's border keeps out: `second`, or the largest of the others.
    beyond: u32,
}

/// Chooses among the groups of what a face sees.
fn choose_groups(
    grid: VoxelGrid,
    cell: vec3<f32>,
    seen: ptr<function, Seen>,
    groups: array<u32, MAX_PLACES>,
) -> ChosenGroups {
    let largest = largest_group((*seen).n, groups, 0u);
    var chosen = ChosenGroups(largest, 0u, 0u);
    var looked_at = 0u;
    var n_open = 0u;
    for (var k = 0u; k < MAX_GROUPS && n_open < 2u; k++) {
        let group = largest_group((*seen).n, groups, looked_at);
        if group == 0u {
            break;
        }
        looked_at |= 1u << (group - 1u);
        // (A single group needs no look.)
        if k == 0u && largest_group((*seen).n, groups, looked_at) == 0u {
            return chosen;
        }
        let middle = middle_of_group(seen, groups, group);
        let normal = unpack_direction((*seen).normals[middle]);
        if is_enclosed(grid, cell + (*seen).places[middle], normal) {
            continue;
        }
        n_open += 1u;
        if n_open == 1u {
            chosen.own = group;
        } else {
            chosen.second = group;
        }
    }
    let others = largest_group((*seen).n, groups, 1u << (chosen.own - 1u));
    chosen.beyond = select(others, chosen.second, chosen.second != 0u);
    return chosen;
}

/// The place of a group (which has some) that is nearest to its middle.
fn middle_of_group(seen: ptr<function, Seen>, groups: array<u32, MAX_PLACES>, group: u32) -> u32 {
    var sum = vec4<f32>(0.0);
    for (var ix = 0u; ix < (*seen).n; ix++) {
        if groups[ix] == group {
            sum += vec4<f32>((*seen).places[ix], 1.0);
        }
    }
    var best = 0u;
    var least = 1e9;
    for (var ix = 0u; ix < (*seen).n; ix++) {
        let away = length((*seen).places[ix] - sum.xyz / sum.w);
        if groups[ix] == group && away < least {
            least = away;
            best = ix;
        }
    }
    return best;
}

/// The packed place of a group (which has some): the one that is nearest to its middle.
fn place_of_group(seen: ptr<function, Seen>, groups: array<u32, MAX_PLACES>, group: u32) -> u32 {
    return pack_place((*seen).places[middle_of_group(seen, groups, group)]);
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
