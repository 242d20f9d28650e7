// SPDX-License-Identifier: MIT OR Apache-2.0
//! Field: a net of probes at any places, and which of them a point is between.
//!
//! Interface: `net`, `net_position`, `net_reach`, `net_weights`. The net is Delaunay's: R. Cupisz, "Light probe interpolation using tetrahedral
//! tessellations", GDC 2012. A walk leads from a cell to the neighbour behind the face that the point is farthest behind; outside
//! the hull, another leads over its faces to the one that is nearest.
#define_import_path lucerna::fields::probe_net

#import lucerna::geometry::nearest_point::{in_tetrahedron, nearest_on_segment, nearest_on_triangle}
#import lucerna::sampling::pcg::pcg

/// No probes; probes on a line, in its order; in a plane. Any other number: in space.
const NET_EMPTY: u32 = 0u;
const NET_LINE: u32 = 1u;
const NET_PLANE: u32 = 2u;
/// Set in the index of what is a face of the hull.
const NET_OUTSIDE: u32 = 0x80000000u;
/// Steps of a walk after which it ends, wherever it is.
const NET_STEPS: u32 = 512u;
/// Steps after which a walk no longer takes the face that the point is farthest behind (O. Devillers, S. Pion, M. Teillaud, "Walking in a
/// Triangulation", 2002: a random choice ends in every Delaunay net).
const NET_CALM_STEPS: u32 = 64u;
/// How far a point may be behind a face and still be in the cell, as a share of an edge: f32 cannot tell.
const NET_ROUNDING: f32 = 1e-6;

struct ProbeNet {
    /// Least corner of the grid of starts [m].
    start_origin: vec3<f32>,
    /// A NET_ constant.
    kind: u32,
    /// Cells of that grid along each axis.
    start_size: vec3<u32>,
    n_points: u32,
    /// Edges of its cells [m].
    start_cell: vec3<f32>,
    /// The unit of probes' distances: how far points are from their nearest ones, in the mean [m].
    unit: f32,
    /// Where cells, faces and starts begin in `net_data`.
    first_cell: u32,
    first_face: u32,
    first_start: u32,
    reserved: u32,
}

struct NetCell {
    vertices: vec4<u32>,
    /// Across the face opposite to each: a cell, or NET_OUTSIDE and a face of the hull.
    neighbours: vec4<u32>,
}

struct NetFace {
    /// Counter-clockwise from outside.
    vertices: vec3<u32>,
    /// Behind it.
    cell: u32,
    /// Across the edges from each corner to the next.
    neighbours: vec3<u32>,
    reserved: u32,
}

/// Probes that a point is between.
struct NetWeights {
    probes: vec4<u32>,
    /// At least 0; their sum is 1, or 0 if there are no probes.
    weights: vec4<f32>,
    /// Cells and faces that were visited.
    n_steps: u32,
    /// False: the walk ended before it was there.
    is_found: bool,
}

@group(3) @binding(38) var<uniform> net: ProbeNet;
/// The net, from the first of each kind on: a `vec4<u32>` for each point (xyz: bits of f32 [m]; w: `net_reach`), two for each cell, two for each
/// face, and a quarter for each cell of the grid of starts.
@group(3) @binding(39) var<storage, read> net_data: array<vec4<u32>>;

/// Where a probe is [m].
fn net_position(probe: u32) -> vec3<f32> {
    return bitcast<vec3<f32>>(net_data[probe].xyz);
}

/// The longest edge at a probe [m].
fn net_reach(probe: u32) -> f32 {
    return bitcast<f32>(net_data[probe].w);
}

/// A cell of the net.
fn net_cell(cell: u32) -> NetCell {
    let at = net.first_cell + 2u * cell;
    return NetCell(net_data[at], net_data[at + 1u]);
}

/// A face of the hull.
fn net_face(face: u32) -> NetFace {
    let at = net.first_face + 2u * face;
    let neighbours = net_data[at + 1u];
    return NetFace(net_data[at].xyz, net_data[at].w, neighbours.xyz, neighbours.w);
}

/// Where a walk to `position` begins.
fn net_start(position: vec3<f32>) -> u32 {
    let last = vec3<f32>(net.start_size) - 1.0;
    let at = vec3<u32>(clamp(floor((position - net.start_origin) / net.start_cell), vec3<f32>(0.0), last));
    let ix = (at.z * net.start_size.y + at.y) * net.start_size.x + at.x;
    return net_data[net.first_start + ix / 4u][ix % 4u];
}

/// The probes beside a point near a line, in whose order they are.
fn line_weights(position: vec3<f32>) -> NetWeights {
    var best = NetWeights(vec4<u32>(0u), vec4<f32>(1.0, 0.0, 0.0, 0.0), 1u, true);
    var nearest = 1e38;
    for (var ix = 0u; ix + 1u < net.n_points; ix++) {
        let a = net_position(ix);
        let b = net_position(ix + 1u);
        let share = nearest_on_segment(position, a, b);
        let apart = position - mix(a, b, share);
        if dot(apart, apart) < nearest {
            nearest = dot(apart, apart);
            best.probes = vec4<u32>(ix, ix + 1u, 0u, 0u);
            best.weights = vec4<f32>(1.0 - share, share, 0.0, 0.0);
        }
    }
    best.n_steps = net.n_points;
    return best;
}

/// The nearest point of the hull to a point outside, from a face of it on.
///
/// Over an edge the walk goes where it is nearer. From a corner, it goes around it, one face after the other, until one is nearer or
/// all have been seen.
fn hull_weights(position: vec3<f32>, start: u32, n_before: u32) -> NetWeights {
    var face = start;
    var best = start;
    var weights = vec3<f32>(0.0);
    var nearest = 1e38;
    var n_steps = n_before;
    // The corner that the walk goes around, and where it began.
    var around = NET_OUTSIDE;
    var began = start;
    var is_found = false;
    while n_steps < NET_STEPS {
        n_steps += 1u;
        let here = net_face(face);
        let a = net_position(here.vertices.x);
        let b = net_position(here.vertices.y);
        let c = net_position(here.vertices.z);
        let found = nearest_on_triangle(position, a, b, c);
        let apart = position - (found.x * a + found.y * b + found.z * c);
        let distance = dot(apart, apart);
        if distance < nearest {
            nearest = distance;
            best = face;
            weights = found;
            around = NET_OUTSIDE;
        } else if around == NET_OUTSIDE || face == began {
            // Over an edge it is not nearer; or all faces around a corner have been seen.
            is_found = true;
            break;
        }
        if around != NET_OUTSIDE {
            // The next face around the corner, across the edge that begins at it.
            let k = select(select(2u, 1u, here.vertices.y == around), 0u, here.vertices.x == around);
            face = here.neighbours[k];
            if face == began {
                is_found = true;
                break;
            }
            continue;
        }
        let n_zeros = u32(found.x == 0.0) + u32(found.y == 0.0) + u32(found.z == 0.0);
        if n_zeros == 0u {
            is_found = true;
            break;
        }
        if n_zeros == 1u {
            // On the edge opposite to the corner of weight 0.
            let k = select(select(0u, 2u, found.y == 0.0), 1u, found.x == 0.0);
            face = here.neighbours[k];
            continue;
        }
        let k = select(select(2u, 1u, found.y != 0.0), 0u, found.x != 0.0);
        around = here.vertices[k];
        began = face;
        face = here.neighbours[k];
    }
    return NetWeights(vec4<u32>(net_face(best).vertices, 0u), vec4<f32>(weights, 0.0), n_steps, is_found);
}

/// Which probes a point is between, and how much each counts. `position` [m].
fn net_weights(position: vec3<f32>) -> NetWeights {
    if net.kind == NET_EMPTY {
        return NetWeights(vec4<u32>(0u), vec4<f32>(0.0), 0u, true);
    }
    if net.kind == NET_LINE {
        return line_weights(position);
    }
    var now = net_start(position);
    var n_steps = 0u;
    if net.kind == NET_PLANE {
        return hull_weights(position, now & ~NET_OUTSIDE, n_steps);
    }
    if (now & NET_OUTSIDE) != 0u {
        // The point may be inside all the same.
        now = net_face(now & ~NET_OUTSIDE).cell;
    }
    // (No cell and no face.)
    var before = 0xffffffffu;
    while (now & NET_OUTSIDE) == 0u && n_steps < NET_STEPS {
        n_steps += 1u;
        let cell = net_cell(now);
        let v = cell.vertices;
        let a = net_position(v.x);
        let b = net_position(v.y);
        let c = net_position(v.z);
        let d = net_position(v.w);
        let inside = in_tetrahedron(position, a, b, c, d);
        let volumes = max(inside.heights * inside.areas, vec4<f32>(0.0));
        let volume = dot(volumes, vec4<f32>(1.0));
        let rounding = NET_ROUNDING * max(length(b - a), max(length(c - a), length(d - a)));
        let most_area = max(max(inside.areas.x, inside.areas.y), max(inside.areas.z, inside.areas.w));
        if all(inside.heights >= vec4<f32>(-rounding)) {
            if volume > rounding * most_area {
                return NetWeights(v, volumes / volume, n_steps, true);
            }
            // A cell that is thinner than f32 can tell: its largest face, if the point is on it; if not, it is passed through.
            var corners = array<vec3<f32>, 4>(a, b, c, d);
            var k = 0u;
            for (var other = 1u; other < 4u; other++) {
                k = select(k, other, inside.areas[other] > inside.areas[k]);
            }
            let i = vec3<u32>(k + 1u, k + 2u, k + 3u) & vec3<u32>(3u);
            let on = nearest_on_triangle(position, corners[i.x], corners[i.y], corners[i.z]);
            let place = on.x * corners[i.x] + on.y * corners[i.y] + on.z * corners[i.z];
            if length(position - place) <= 4.0 * rounding {
                return NetWeights(vec4<u32>(v[i.x], v[i.y], v[i.z], v[k]), vec4<f32>(on, 0.0), n_steps, true);
            }
        }
        // Through the face that it is farthest behind, but not back; after many steps through any that it is behind: among flat cells, where
        // heights are rounded, the walk could go in circles.
        let first = select(0u, pcg(n_steps) & 3u, n_steps > NET_CALM_STEPS);
        var least = select(first, (first + 1u) & 3u, cell.neighbours[first] == before);
        for (var ix = 1u; ix < 4u; ix++) {
            let k = (first + ix) & 3u;
            let is_better = select(inside.heights[k] < inside.heights[least], inside.heights[least] >= 0.0, n_steps > NET_CALM_STEPS);
            if cell.neighbours[k] != before && is_better {
                least = k;
            }
        }
        before = now;
        now = cell.neighbours[least];
    }
    if (now & NET_OUTSIDE) == 0u {
        // Out of steps: the nearest corner of the last cell.
        return NetWeights(net_cell(now).vertices, vec4<f32>(1.0, 0.0, 0.0, 0.0), n_steps, false);
    }
    return hull_weights(position, now & ~NET_OUTSIDE, n_steps);
}
