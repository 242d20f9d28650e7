// SPDX-License-Identifier: MIT OR Apache-2.0
//! The surfel of a voxel's face (`lucerna::components::voxel_surfels::surfel`), found by rays along the face's axis.
//!
//! What such rays hit on the record's side (`lucerna::components::voxel_light::sides`) is its surface: across the mean of its
//! normals stands the plane, through the foremost point. (Behind it, it could stand in the air on the other side: a low step seen from below, through the middle of both heights.) Its opacity is the share of rays that hit the surface, among those that meet the plane
//! within the cell and are not kept from it by something else. Where a surface ends in its cell, a line divides those from
//! the others, which becomes the surfel's border. What keeps a ray from it, a wall at the end of the floor, is its
//! border: seen from the other side of the wall, the floor is not there.
//!
//! Bindings: none of its own; it uses the scene seam.
#define_import_path lucerna::integrators::face_surfel

#import lucerna::components::voxel_light::face_point::{FACE_RAY_LENGTH, face_point}
#import lucerna::components::voxel_light::sides::{NO_BORDER, border_normal, pack_border, pack_place, unpack_place}
#import lucerna::components::voxel_surfels::surfel::{OFFSET_RANGE, Surfel}
#import lucerna::components::voxels::grid::{VoxelGrid, face_normal, grid_from_world, unpack_cell, world_from_grid}
#import lucerna::integrators::face_sides::{HEIGHT, MAX_LAYERS, N_PROBES, border_between, next_layer, place_above, ray_between, see_each_other}
#import lucerna::math::vector::safe_normalize
#import lucerna::sampling::low_discrepancy::sobol_owen
#import lucerna::sampling::pcg::pcg
#import lucerna::scene::rays::any_hit
#import lucerna::scene::surface::surface_over
#import lucerna::scene::types::seen_from

/// A border's normal has at most this cosine to that of the surfel; what stands more in line is the surface itself, which bends.
const LEAST_ACROSS: f32 = 0.7;

/// How far a surface may be from its plane along the face's axis where the plane counts as surface [cells].
const ROUGHNESS: f32 = 0.25;

/// The surfel of a record whose packed place and border are these; opacity 0 if nothing is found.
fn find_surfel(grid: VoxelGrid, packed_cell: u32, face: u32, place_word: u32, border: u32) -> Surfel {
    let place = unpack_place(place_word);
    let cell = vec3<f32>(unpack_cell(packed_cell));
    let outward = face_normal(face);
    let seed = pcg(packed_cell + pcg(face));
    var points: array<vec3<f32>, N_PROBES>;
    var normal = vec3<f32>(0.0);
    var albedo = vec3<f32>(0.0);
    // Bit k: ray k hit the surface.
    var hits = 0u;
    for (var probe = 0u; probe < N_PROBES; probe++) {
        var origin = world_from_grid(grid, face_point(cell, face, sobol_owen(probe, seed)));
        var length = grid.cell * FACE_RAY_LENGTH;
        for (var ix = 0u; ix < MAX_LAYERS; ix++) {
            let layer = next_layer(origin, outward, length);
            if !layer.is_surface {
                break;
            }
            let surface = seen_from(layer.surface, -outward);
            let above = place_above(grid, surface);
            if see_each_other(grid, cell + place, above) {
                // (The mean of 16 points, each as wide as a quarter of the cell.)
                albedo += surface_over(layer.triangle, layer.barycentrics, 0.25 * grid.cell).albedo;
                points[probe] = grid_from_world(grid, surface.position) - cell;
                normal += surface.geometric_normal;
                hits |= 1u << probe;
                break;
            }
            origin = layer.origin;
            length = layer.length;
        }
    }
    var surfel = Surfel(outward, 0.0, vec3<f32>(0.0), 0.0, border);
    if hits == 0u {
        return surfel;
    }
    let n_hits = f32(countOneBits(hits));
    surfel.albedo = albedo / n_hits;
    surfel.normal = safe_normalize(normal, outward);
    surfel.offset = -OFFSET_RANGE;
    for (var probe = 0u; probe < N_PROBES; probe++) {
        if (hits & (1u << probe)) != 0u {
            surfel.offset = max(surfel.offset, dot(surfel.normal, points[probe] - 0.5));
        }
    }
    // The rays that did not hit the surface, but reach its plane within the cell; bit k: ray k.
    var open = 0u;
    let slope = dot(surfel.normal, outward);
    for (var probe = 0u; probe < N_PROBES; probe++) {
        if (hits & (1u << probe)) != 0u || slope <= 0.0 {
            continue;
        }
        let start = face_point(cell, face, sobol_owen(probe, seed)) - cell;
        let depth = (dot(surfel.normal, start - 0.5) - surfel.offset) / slope;
        if depth < 0.0 || depth > FACE_RAY_LENGTH {
            continue;
        }
        let place_on_plane = start - depth * outward;
        // (What bends or is rough leaves the cell where the plane does not.)
        let margin = ROUGHNESS * outward;
        if any_hit(ray_between(grid, cell + place_on_plane + margin, cell + place_on_plane - margin)) {
            continue;
        }
        let above = place_on_plane + HEIGHT * surfel.normal;
        if see_each_other(grid, cell + place, cell + above) {
            points[probe] = place_on_plane;
            open |= 1u << probe;
        } else if surfel.border == NO_BORDER {
            let between = border_between(grid, cell, place_word, pack_place(above));
            if between != NO_BORDER && abs(dot(border_normal(between), surfel.normal)) <= LEAST_ACROSS {
                surfel.border = between;
            }
        }
    }
    if surfel.border == NO_BORDER && open != 0u {
        let edge = edge_between(surfel.normal, &points, hits, open);
        surfel.border = edge.border;
        hits &= edge.before;
        open &= edge.before;
    }
    surfel.opacity = f32(countOneBits(hits)) / f32(max(countOneBits(hits | open), 1u));
    return surfel;
}

/// The line at which a surface ends in its cell.
struct SurfelEdge {
    /// The plane through it, across the surface; NO_BORDER: there is none.
    border: u32,
    /// Bit k: point k is before it.
    before: u32,
}

/// The straight line that best divides the points of a surface from those where its plane is open.
///
/// `normal`: of the surface, unit length; `points`: from the cell's corner [cells]; `hits`, `open`: which of them are of which kind, some of each.
fn edge_between(normal: vec3<f32>, points: ptr<function, array<vec3<f32>, N_PROBES>>, hits: u32, open: u32) -> SurfelEdge {
    let both = hits | open;
    var middle_of_hits = vec3<f32>(0.0);
    var middle_of_open = vec3<f32>(0.0);
    for (var ix = 0u; ix < N_PROBES; ix++) {
        middle_of_hits += select(vec3<f32>(0.0), (*points)[ix], (hits & (1u << ix)) != 0u);
        middle_of_open += select(vec3<f32>(0.0), (*points)[ix], (open & (1u << ix)) != 0u);
    }
    let apart = middle_of_hits / f32(countOneBits(hits)) - middle_of_open / f32(countOneBits(open));
    let along = apart - dot(apart, normal) * normal;
    if length(along) < 1e-3 {
        return SurfelEdge(NO_BORDER, ~0u);
    }
    let direction = normalize(along);
    // The line through each point in turn; it belongs to the hits.
    var best = SurfelEdge(NO_BORDER, ~0u);
    var least = countOneBits(open);
    for (var ix = 0u; ix < N_PROBES; ix++) {
        if (hits & (1u << ix)) == 0u {
            continue;
        }
        let here = dot(direction, (*points)[ix]);
        var before = 0u;
        var next = here - 1.0;
        for (var other = 0u; other < N_PROBES; other++) {
            let there = dot(direction, (*points)[other]);
            let is_before = there >= here;
            before |= select(0u, 1u << other, is_before);
            if !is_before && (both & (1u << other)) != 0u {
                next = max(next, there);
            }
        }
        let n_wrong = countOneBits(open & before) + countOneBits(hits & ~before);
        if n_wrong < least {
            least = n_wrong;
            // Half-way to the next point beyond.
            let middle = (*points)[ix] + 0.5 * (next - here) * direction;
            best = SurfelEdge(pack_border(direction, middle), before);
        }
    }
    return best;
}
