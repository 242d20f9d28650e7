// SPDX-License-Identifier: MIT OR Apache-2.0
//! Triangulates polygons.

use std::collections::HashMap;

use glam::{DVec2, DVec3, Vec3};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

use crate::scene::error::LineProblem;

/// The largest relative difference between the area of the triangles and that of the polygon;
/// beyond it, the outline counts as self-intersecting.
const AREA_TOLERANCE: f64 = 1e-6;

/// Triangles, as indices of corners, that fill the polygon and keep its winding, also for concave
/// polygons and polygons with bridges to holes. An outline that intersects itself gives a fan.
/// `corners` must have at least 3 elements.
///
/// Corners are projected on the plane of Newell's normal (the sum of the cross products of
/// successive corners, which exists for bent polygons too); beyond 4 corners the triangles are
/// those of the constrained Delaunay triangulation.
pub(super) fn triangulate(
    corners: &[Vec3],
    max_corners: usize,
) -> (Vec<[u32; 3]>, Option<LineProblem>) {
    let n = corners.len();
    // Triangles that are not finite are dropped and counted later.
    if n <= 3 || !corners.iter().all(|c| c.is_finite()) {
        return (fan(n), None);
    }
    if n > max_corners {
        return (fan(n), Some(LineProblem::ManyCorners));
    }
    let Some(flat) = project(corners) else {
        return (Vec::new(), Some(LineProblem::FlatPolygon));
    };
    let triangles = if n == 4 { quad(&flat) } else { delaunay(&flat) };
    match triangles {
        Some(triangles) => (triangles, None),
        None => (fan(n), Some(LineProblem::SelfIntersecting)),
    }
}

fn fan(n: usize) -> Vec<[u32; 3]> {
    (2..n as u32).map(|i| [0, i - 1, i]).collect()
}

/// Corners in the polygon's plane, counter-clockwise, scaled into −2..=2.
fn project(corners: &[Vec3]) -> Option<Vec<DVec2>> {
    let origin = corners[0].as_dvec3();
    let mut points: Vec<DVec3> = corners.iter().map(|c| c.as_dvec3() - origin).collect();
    let size = points.iter().fold(0.0, |s: f64, p| s.max(p.abs().max_element()));
    if size == 0.0 {
        return None;
    }
    for point in &mut points {
        *point /= size;
    }
    let normal: DVec3 =
        points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.cross(*b)).sum();
    let normal = normal.try_normalize()?;
    let (x, y) = normal.any_orthonormal_pair();
    debug_assert!(x.cross(y).dot(normal) > 0.0);
    // spade rejects coordinates that are too close to 0; f32 input has no such differences next to
    // 1.
    let tame = |v: f64| if v.abs() < 1e-30 { 0.0 } else { v };
    Some(points.iter().map(|p| DVec2::new(tame(p.dot(x)), tame(p.dot(y)))).collect())
}

/// Twice the area, positive if counter-clockwise.
fn area(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Chooses the diagonal whose smaller triangle is larger, because a diagonal outside of a concave
/// quad makes a triangle of negative area. If both are equal, the first.
fn quad(p: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let first = area(p[0], p[1], p[2]).min(area(p[0], p[2], p[3]));
    let second = area(p[0], p[1], p[3]).min(area(p[1], p[2], p[3]));
    let total = area(p[0], p[1], p[2]) + area(p[0], p[2], p[3]);
    let slack = AREA_TOLERANCE * total;
    if first.max(second) < -slack {
        None
    } else if second > first + slack {
        Some(vec![[0, 1, 3], [1, 2, 3]])
    } else {
        Some(vec![[0, 1, 2], [0, 2, 3]])
    }
}

/// A corner with its number.
struct Corner {
    position: DVec2,
    ix: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.position.x, self.position.y)
    }
}

fn delaunay(points: &[DVec2]) -> Option<Vec<[u32; 3]>> {
    let mut cdt = ConstrainedDelaunayTriangulation::<Corner>::new();
    let mut handles = Vec::with_capacity(points.len());
    let mut known: HashMap<[u64; 2], _> = HashMap::with_capacity(points.len());
    for (ix, &position) in (0u32..).zip(points) {
        // Corners at the same place (bridges to holes) are one vertex; `+ 0.0` turns −0 into 0.
        let key = (position + DVec2::ZERO).to_array().map(f64::to_bits);
        let handle = match known.get(&key) {
            Some(&handle) => handle,
            None => {
                let handle = cdt.insert(Corner { position, ix }).ok()?;
                known.insert(key, handle);
                handle
            }
        };
        handles.push(handle);
    }

    // Whether the outline runs along an edge an odd or even number of times: twice along a bridge
    // to a hole.
    let mut odd: HashMap<[usize; 2], bool> = HashMap::with_capacity(points.len());
    for (&from, &to) in handles.iter().zip(handles.iter().cycle().skip(1)) {
        if from == to {
            continue;
        }
        let edges = cdt.try_add_constraint(from, to);
        if edges.is_empty() {
            return None;
        }
        for edge in edges {
            let ends = edge_key(cdt.directed_edge(edge).vertices().map(|v| v.index()));
            *odd.entry(ends).or_default() ^= true;
        }
    }

    // A face is inside if the outline has been crossed an odd number of times. Each entry: an edge
    // whose left face has not been visited, and whether its right face is inside.
    let mut inside: Vec<Option<bool>> = vec![None; cdt.num_all_faces()];
    let mut stack = Vec::new();
    for hull in cdt.convex_hull() {
        let inward = if hull.is_outer_edge() { hull.rev() } else { hull };
        stack.push((inward, false));
    }
    let mut triangles = Vec::with_capacity(points.len().saturating_sub(2));
    let mut filled = 0.0;
    while let Some((edge, beyond)) = stack.pop() {
        let Some(face) = edge.face().as_inner() else {
            continue;
        };
        if inside[face.index()].is_some() {
            continue;
        }
        let ends = edge_key(edge.vertices().map(|v| v.index()));
        let here = beyond ^ odd.get(&ends).copied().unwrap_or(false);
        inside[face.index()] = Some(here);
        if here {
            let corners = face.vertices().map(|v| (v.data().position, v.data().ix));
            filled += area(corners[0].0, corners[1].0, corners[2].0);
            triangles.push(corners.map(|(_, ix)| ix));
        }
        stack.extend(face.adjacent_edges().map(|edge| (edge.rev(), here)));
    }

    let outline: f64 =
        points.iter().zip(points.iter().cycle().skip(1)).map(|(a, b)| a.perp_dot(*b)).sum();
    // If the outline winds twice or backwards, the crossings do not give the area.
    ((filled - outline).abs() <= AREA_TOLERANCE * outline).then_some(triangles)
}

fn edge_key([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid_area(corners: &[Vec3], triangles: &[[u32; 3]]) -> f32 {
        triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| corners[i as usize]);
                (b - a).cross(c - a).z / 2.0
            })
            .sum()
    }

    fn flat(points: &[[f32; 2]]) -> Vec<Vec3> {
        points.iter().map(|p| Vec3::new(p[0], p[1], 3.0)).collect()
    }

    /// Outline, area, triangles.
    type Case = (&'static str, &'static [[f32; 2]], f32, usize);

    #[test]
    fn areas_and_winding() {
        let cases: [Case; 7] = [
            ("square", &[[0., 0.], [2., 0.], [2., 2.], [0., 2.]], 4.0, 2),
            // Concave at the second corner, so that the diagonal 0–2 lies outside.
            ("dart", &[[0., 0.], [1., 1.], [2., 0.], [1., 4.]], 3.0, 2),
            ("dart turned", &[[1., 4.], [0., 0.], [1., 1.], [2., 0.]], 3.0, 2),
            ("L", &[[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]], 3.0, 4),
            (
                "comb",
                &[
                    [0., 0.],
                    [5., 0.],
                    [5., 3.],
                    [4., 3.],
                    [4., 1.],
                    [3., 1.],
                    [3., 3.],
                    [2., 3.],
                    [2., 1.],
                    [1., 1.],
                    [1., 3.],
                    [0., 3.],
                ],
                11.0,
                10,
            ),
            (
                "square with a corner on a side",
                &[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.]],
                4.0,
                3,
            ),
            (
                // The bridge 0–4 is run there and back.
                "square with a hole",
                &[
                    [0., 0.],
                    [4., 0.],
                    [4., 4.],
                    [0., 4.],
                    [0., 0.],
                    [1., 1.],
                    [1., 3.],
                    [3., 3.],
                    [3., 1.],
                    [1., 1.],
                ],
                12.0,
                8,
            ),
        ];
        for (name, points, expected, n) in cases {
            let corners = flat(points);
            let (triangles, problem) = triangulate(&corners, 100);
            assert_eq!(problem, None, "{name}");
            assert_eq!(triangles.len(), n, "{name}");
            let found = solid_area(&corners, &triangles);
            assert!((found - expected).abs() < 1e-5, "{name}: {found}");
            for t in &triangles {
                assert!(solid_area(&corners, &[*t]) > 0.0, "{name}: {t:?} turned");
            }
            // The other way round, the triangles turn too.
            let turned: Vec<Vec3> = corners.iter().rev().copied().collect();
            let (triangles, _) = triangulate(&turned, 100);
            let found = solid_area(&turned, &triangles);
            assert!((found + expected).abs() < 1e-5, "{name} turned: {found}");
        }
    }

    #[test]
    fn star_pentagons_and_bow_ties_become_fans() {
        let star: Vec<Vec3> = (0..5)
            .map(|i| {
                let (sin, cos) = (i as f32 * 2.0 * std::f32::consts::TAU / 5.0).sin_cos();
                Vec3::new(cos, sin, 0.0)
            })
            .collect();
        let bow_tie = flat(&[[0., 0.], [3., 2.], [3., 0.], [0., 1.]]);
        for corners in [star, bow_tie] {
            let (triangles, problem) = triangulate(&corners, 100);
            assert_eq!(problem, Some(LineProblem::SelfIntersecting));
            assert_eq!(triangles, fan(corners.len()));
        }
    }

    #[test]
    fn no_area_no_triangles() {
        let line = flat(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.], [4., 0.]]);
        let point = vec![Vec3::ONE; 5];
        for corners in [line, point] {
            let (triangles, problem) = triangulate(&corners, 100);
            assert_eq!(problem, Some(LineProblem::FlatPolygon));
            assert!(triangles.is_empty());
        }
    }

    #[test]
    fn too_many_corners_become_a_fan() {
        let circle: Vec<Vec3> = (0..20)
            .map(|i| {
                let (sin, cos) = (i as f32 / 20.0 * std::f32::consts::TAU).sin_cos();
                Vec3::new(cos, sin, 0.0)
            })
            .collect();
        let (triangles, problem) = triangulate(&circle, 19);
        assert_eq!(problem, Some(LineProblem::ManyCorners));
        assert_eq!(triangles.len(), 18);
    }
}
