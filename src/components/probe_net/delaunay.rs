// SPDX-License-Identifier: MIT OR Apache-2.0
//! Delaunay triangulations of points in space and in a plane, by `simple_delaunay_lib` and `spade`, checked.
//!
//! The crate for space hangs on duplicates and fails on coplanar points, so both are found before it is called; what it returns is
//! checked with exact predicates (`robust`).

use super::{NetCell, NetError, NetFace, OUTSIDE};
use glam::{DVec2, DVec3};
use robust::{Coord3D, insphere, orient3d};
use simple_delaunay_lib::delaunay_3d::delaunay_struct_3d::DelaunayStructure3D;
use simple_delaunay_lib::delaunay_3d::simplicial_struct_3d::Node;
use spade::{DelaunayTriangulation, Point2, Triangulation};
use std::collections::{HashMap, HashSet};

/// Corners of the face opposite to each corner of a tetrahedron, seen counter-clockwise from outside if the tetrahedron is positively oriented.
const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

fn coord(p: DVec3) -> Coord3D<f64> {
    Coord3D { x: p.x, y: p.y, z: p.z }
}

/// Six times the volume, exact in its sign: above 0 if d is on the side of abc from which they are counter-clockwise … of `FACES`' kind.
pub(super) fn orientation([a, b, c, d]: [DVec3; 4]) -> f64 {
    -orient3d(coord(a), coord(b), coord(c), coord(d))
}

/// Tetrahedra of points of which no two are the same and not all in a plane, and the faces of their hull.
///
/// Cells on the hull that are flatter than `flat` \[m\] are left out: where many points are in one plane, as those of grids are, roundings make such
/// cells, and walks along the hull would have nowhere to go.
pub(super) fn in_space(
    points: &[DVec3],
    flat: f64,
) -> Result<(Vec<NetCell>, Vec<NetFace>), NetError> {
    let failed = |what: &str| NetError::Triangulation(what.to_owned());
    let mut delaunay = DelaunayStructure3D::new();
    // The crate looks for a first tetrahedron among neighbours, and finds none in long grids: begin with one that is as large as possible.
    let first = first_tetrahedron(points);
    let is_later = |ix: &usize| !first.contains(ix);
    let order: Vec<usize> = first.into_iter().chain((0..points.len()).filter(is_later)).collect();
    let list: Vec<[f64; 3]> = order.iter().map(|ix| points[*ix].to_array()).collect();
    for part in [&list[..4], &list[4..]].into_iter().filter(|part| !part.is_empty()) {
        let inserted = delaunay.insert_vertices(&part.to_vec(), true);
        inserted.map_err(|error| failed(&error.to_string()))?;
    }
    let all = delaunay.get_simplicial();
    let mut cells = Vec::new();
    for ix in 0..all.get_nb_tetrahedra() {
        let of = all.get_tetrahedron(ix).map_err(|error| failed(&error.to_string()))?;
        let mut vertices = [0u32; 4];
        let mut is_finite = true;
        for (vertex, node) in vertices.iter_mut().zip(of.nodes()) {
            match node {
                Node::Value(point) => *vertex = order[point] as u32,
                Node::Infinity => is_finite = false,
            }
        }
        if is_finite {
            cells.push(NetCell { vertices, neighbours: [OUTSIDE; 4] });
        }
    }
    // The crate turns all cells the same way; what flat ones are turned by does not show in their volumes.
    let turned = |cell: &NetCell| orientation(cell.vertices.map(|v| points[v as usize]));
    if cells.iter().map(turned).find(|turned| *turned != 0.0).is_some_and(|turned| turned < 0.0) {
        cells.iter_mut().for_each(|cell| cell.vertices.swap(2, 3));
    }
    let hull = connect(&mut cells);
    let mut flat_ones = flat_at_hull(points, &cells, &hull, flat);
    let (mut kept, hull) = loop {
        let is_kept = |(ix, cell): (usize, &NetCell)| (!flat_ones.contains(&ix)).then_some(*cell);
        let mut kept: Vec<NetCell> = cells.iter().enumerate().filter_map(is_kept).collect();
        let hull = connect(&mut kept);
        // Where the surface would touch itself, flat cells stay.
        let touched = touched_corners(&kept, &hull);
        let n_before = flat_ones.len();
        flat_ones.retain(|ix| !cells[*ix].vertices.iter().any(|v| touched.contains(v)));
        if flat_ones.len() == n_before {
            break (kept, hull);
        }
    };
    let faces = faces_of(&mut kept, &hull).map_err(failed)?;
    check(points, &kept)?;
    Ok((kept, faces))
}

/// Cells flatter than `flat` \[m\] that lie on the hull, or on others of their kind that do.
fn flat_at_hull(
    points: &[DVec3],
    cells: &[NetCell],
    hull: &[(usize, usize)],
    flat: f64,
) -> HashSet<usize> {
    let is_flat = |ix: usize| {
        let at = cells[ix].vertices.map(|v| points[v as usize]);
        let area = |face: [usize; 3]| {
            let [a, b, c] = face.map(|corner| at[corner]);
            (b - a).cross(c - a).length()
        };
        orientation(at) <= flat * FACES.map(area).into_iter().fold(0.0, f64::max)
    };
    let mut out: HashSet<usize> = HashSet::new();
    let mut next: Vec<usize> = hull.iter().map(|(cell, _)| *cell).collect();
    while let Some(ix) = next.pop() {
        if !out.contains(&ix) && is_flat(ix) {
            out.insert(ix);
            let inner = cells[ix].neighbours.iter().filter(|n| *n & OUTSIDE == 0);
            next.extend(inner.map(|n| *n as usize));
        }
    }
    out
}

/// Corners at which the surface of some cells touches itself: around them, its faces are not one ring.
fn touched_corners(cells: &[NetCell], hull: &[(usize, usize)]) -> HashSet<u32> {
    // For each corner, the edges opposite to it of its faces.
    let mut rings: HashMap<u32, Vec<[u32; 2]>> = HashMap::new();
    for &(cell, side) in hull {
        let face = FACES[side].map(|corner| cells[cell].vertices[corner]);
        for k in 0..3 {
            rings.entry(face[k]).or_default().push([face[(k + 1) % 3], face[(k + 2) % 3]]);
        }
    }
    let is_ring = |edges: &Vec<[u32; 2]>| {
        let next: HashMap<u32, u32> = edges.iter().map(|[from, to]| (*from, *to)).collect();
        let mut at = edges[0][0];
        for n in 1..=edges.len() {
            match next.get(&at) {
                Some(to) => at = *to,
                None => return false,
            }
            if at == edges[0][0] {
                return n == edges.len();
            }
        }
        false
    };
    rings.iter().filter(|(_, edges)| !is_ring(edges)).map(|(corner, _)| *corner).collect()
}

/// Four points that are far from each other: from the first, from a line, from a plane.
fn first_tetrahedron(points: &[DVec3]) -> [usize; 4] {
    let farthest = |of: &dyn Fn(DVec3) -> f64| {
        let far = |a: &usize, b: &usize| of(points[*a]).total_cmp(&of(points[*b]));
        (0..points.len()).max_by(far).unwrap_or(0)
    };
    let a = points[0];
    let b = farthest(&|p| p.distance(a));
    let along = points[b] - a;
    let c = farthest(&|p| along.cross(p - a).length());
    let normal = along.cross(points[c] - a);
    [0, b, c, farthest(&|p| normal.dot(p - a).abs())]
}

/// Sets the neighbours of cells; returns the cells and sides that have none: the hull.
fn connect(cells: &mut [NetCell]) -> Vec<(usize, usize)> {
    let mut open: HashMap<[u32; 3], (usize, usize)> = HashMap::new();
    for ix in 0..cells.len() {
        for (side, face) in FACES.iter().enumerate() {
            let mut key = face.map(|corner| cells[ix].vertices[corner]);
            key.sort_unstable();
            match open.remove(&key) {
                Some((other, other_side)) => {
                    cells[ix].neighbours[side] = other as u32;
                    cells[other].neighbours[other_side] = ix as u32;
                }
                None => drop(open.insert(key, (ix, side))),
            }
        }
    }
    let mut hull: Vec<(usize, usize)> = open.into_values().collect();
    hull.sort_unstable();
    hull
}

/// The faces of the hull, which become the neighbours of their cells.
fn faces_of(cells: &mut [NetCell], hull: &[(usize, usize)]) -> Result<Vec<NetFace>, &'static str> {
    let mut faces: Vec<NetFace> = hull
        .iter()
        .map(|&(cell, side)| NetFace {
            vertices: FACES[side].map(|corner| cells[cell].vertices[corner]),
            cell: cell as u32,
            neighbours: [OUTSIDE; 3],
            reserved: 0,
        })
        .collect();
    for (face, &(cell, side)) in hull.iter().enumerate() {
        cells[cell].neighbours[side] = OUTSIDE | face as u32;
    }
    connect_faces(&mut faces)?;
    Ok(faces)
}

/// Sets the neighbours of the faces of a closed surface: neighbour k lies across the edge from corner k to the next.
fn connect_faces(faces: &mut [NetFace]) -> Result<(), &'static str> {
    let mut edges: HashMap<[u32; 2], (usize, usize)> = HashMap::new();
    for (ix, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let edge = [face.vertices[k], face.vertices[(k + 1) % 3]];
            if edges.insert(edge, (ix, k)).is_some() {
                return Err("two faces of the hull have the same edge");
            }
        }
    }
    for (&[from, to], &(ix, k)) in &edges {
        let Some(&(other, _)) = edges.get(&[to, from]) else {
            return Err("the hull is not closed");
        };
        faces[ix].neighbours[k] = other as u32;
    }
    Ok(())
}

/// Every point is used, and no sphere around a cell has the point behind one of its faces inside: then none has any.
fn check(points: &[DVec3], cells: &[NetCell]) -> Result<(), NetError> {
    let failed = |what: String| Err(NetError::Triangulation(what));
    let mut is_used = vec![false; points.len()];
    for cell in cells {
        let at = cell.vertices.map(|v| points[v as usize]);
        if orientation(at) < 0.0 {
            return failed("a cell is inside out".into());
        }
        cell.vertices.iter().for_each(|v| is_used[*v as usize] = true);
        for neighbour in cell.neighbours.iter().filter(|n| *n & OUTSIDE == 0) {
            let beyond = cells[*neighbour as usize];
            let Some(apex) = beyond.vertices.iter().find(|v| !cell.vertices.contains(v)) else {
                return failed("two cells have the same corners".into());
            };
            let [a, b, c, d] = at.map(coord);
            // (Positive inside for points of the other orientation.)
            let inside = insphere(a, c, b, d, coord(points[*apex as usize]));
            if inside > 0.0 && orientation(at) > 0.0 {
                return failed("a sphere around a cell has a point inside".into());
            }
        }
    }
    match is_used.iter().position(|is_used| !is_used) {
        Some(point) => failed(format!("point {point} is not used")),
        None => Ok(()),
    }
}

/// Both sides of the triangles of points in a plane, of which no two are the same and not all on a line: a closed surface, which is
/// flat. Triangles at the border that are narrower than `flat` \[m\] are left out, as in [`in_space`].
pub(super) fn in_plane(points: &[DVec2], flat: f64) -> Result<Vec<NetFace>, NetError> {
    let failed = |what: String| NetError::Triangulation(what);
    let list: Vec<_> = points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let triangulation = DelaunayTriangulation::<Point2<f64>>::bulk_load_stable(list)
        .map_err(|error| failed(error.to_string()))?;
    if triangulation.num_vertices() != points.len() {
        return Err(failed("points are too near to each other".into()));
    }
    let mut front: Vec<[u32; 3]> = triangulation
        .inner_faces()
        .map(|face| face.vertices().map(|vertex| vertex.fix().index() as u32))
        .collect();
    while let Some(left_out) = narrow_triangle(points, &front, flat) {
        front.swap_remove(left_out);
    }
    let mut faces: Vec<NetFace> = front
        .into_iter()
        .flat_map(|[a, b, c]| [[a, b, c], [a, c, b]])
        .map(|vertices| NetFace { vertices, cell: OUTSIDE, neighbours: [OUTSIDE; 3], reserved: 0 })
        .collect();
    connect_sides(&mut faces)?;
    Ok(faces)
}

/// A triangle that can be left out: narrow, with one edge at the border, and the corner opposite to it not.
fn narrow_triangle(points: &[DVec2], triangles: &[[u32; 3]], flat: f64) -> Option<usize> {
    let edges = |of: [u32; 3]| [0, 1, 2].map(|k| [of[k], of[(k + 1) % 3]]);
    let all: HashSet<[u32; 2]> = triangles.iter().flat_map(|of| edges(*of)).collect();
    let is_border = |&[from, to]: &[u32; 2]| !all.contains(&[to, from]);
    let border: HashSet<u32> =
        triangles.iter().flat_map(|of| edges(*of)).filter(is_border).flatten().collect();
    triangles.iter().position(|&of| {
        let [a, b, c] = of.map(|v| points[v as usize]);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let at_border: Vec<_> = edges(of).into_iter().filter(is_border).collect();
        let [edge] = at_border.as_slice() else { return false };
        let is_narrow = (b - a).perp_dot(c - a).abs() <= flat * longest;
        is_narrow && of.iter().any(|v| !edge.contains(v) && !border.contains(v))
    })
}

/// As [`connect_faces`], for faces of two sides, in turn: the neighbour on the same side, or, at the border, the other side.
fn connect_sides(faces: &mut [NetFace]) -> Result<(), NetError> {
    for side in 0..2 {
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        let own: Vec<usize> = (side..faces.len()).step_by(2).collect();
        for &ix in &own {
            for k in 0..3 {
                edges.insert([faces[ix].vertices[k], faces[ix].vertices[(k + 1) % 3]], ix);
            }
        }
        for &ix in &own {
            for k in 0..3 {
                let back = [faces[ix].vertices[(k + 1) % 3], faces[ix].vertices[k]];
                // (The other side of the same triangle.)
                let other = edges.get(&back).copied().unwrap_or(ix ^ 1);
                faces[ix].neighbours[k] = other as u32;
            }
        }
    }
    Ok(())
}
