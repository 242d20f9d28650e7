// SPDX-License-Identifier: MIT OR Apache-2.0
//! Receivers: the texels of a lightmap that surfaces meet, with the points of surfaces in each.

use super::{LightmapUvs, NO_CHART};
use glam::{DVec2, DVec3, Vec3};
use std::collections::HashMap;

/// Points of surfaces that a texel has at most.
pub const POINTS_PER_TEXEL: usize = SIDE * SIDE;
/// Points along each side of a texel.
const SIDE: usize = 4;

/// A point on a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct SurfacePoint {
    /// The triangle.
    pub triangle: u32,
    /// Weights of its second and third corner, as 16-bit unorms, the second in the low half (`pack2x16unorm`).
    pub weights: u32,
}

impl SurfacePoint {
    /// `weights`: of the second and third corner, in a triangle or near it.
    fn new(triangle: u32, weights: DVec2) -> Self {
        let inside = weights.max(DVec2::ZERO);
        let [b, c] = (inside / (inside.x + inside.y).max(1.0)).to_array();
        // (Rounded down, so that the sum stays below 1.)
        let unorm = |x: f64| (x * 65535.0).floor() as u32;
        Self { triangle, weights: unorm(b) | unorm(c) << 16 }
    }

    /// Weights of the three corners.
    pub fn weights_of_corners(self) -> [f64; 3] {
        let of = |bits: u32| f64::from(bits & 0xffff) / 65535.0;
        let (b, c) = (of(self.weights), of(self.weights >> 16));
        [1.0 - b - c, b, c]
    }

    /// Where it is; `corners`: of the triangle.
    pub fn position(self, corners: &[Vec3; 3]) -> Vec3 {
        let weights = self.weights_of_corners();
        let sum: DVec3 = (0..3).map(|k| corners[k].as_dvec3() * weights[k]).sum();
        sum.as_vec3()
    }
}

/// The texels of a lightmap that surfaces meet: conservatively, each texel whose square a chart touches. In rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Receivers {
    /// Column and row of each.
    pub texels: Vec<[u16; 2]>,
    /// Where the points of each begin in `points`; one more, where the last one's end.
    pub first: Vec<u32>,
    /// Points of surfaces within the texels, at least one each: the one nearest to the texel's centre first.
    pub points: Vec<SurfacePoint>,
    /// Where in its texel each point is: of 4 × 4 places, row by row; or [`ANY_PLACE`] if the texel is touched between these alone.
    pub places: Vec<u8>,
}

/// A point that is at none of the 4 × 4 places of its texel.
pub const ANY_PLACE: u8 = 255;

impl Receivers {
    /// The texels of all charts.
    pub fn of(uvs: &LightmapUvs) -> Self {
        // Points within texels: of 4 × 4 places in a texel, those that a triangle covers.
        let mut found: Vec<(u32, u8, SurfacePoint)> = Vec::new();
        let mut is_covered = vec![false; (uvs.size.x * uvs.size.y) as usize];
        let charted = || (0..uvs.corners.len()).filter(|ix| uvs.charts[*ix] != NO_CHART);
        for ix in charted() {
            let flat = Flat::new(uvs, ix);
            flat.for_each_place(uvs, |texel, place, weights| {
                is_covered[texel as usize] = true;
                found.push((texel, place, SurfacePoint::new(ix as u32, weights)));
            });
        }
        // Texels that are only touched: the nearest point of what touches them.
        let mut touched: HashMap<u32, (f64, SurfacePoint)> = HashMap::new();
        for ix in charted() {
            let flat = Flat::new(uvs, ix);
            flat.for_each_touched(uvs, |texel, centre| {
                if is_covered[texel as usize] {
                    return;
                }
                let (distance, weights) = flat.nearest(centre);
                let point = SurfacePoint::new(ix as u32, weights);
                let known = touched.entry(texel).or_insert((distance, point));
                if distance < known.0 {
                    *known = (distance, point);
                }
            });
        }
        found.extend(touched.into_iter().map(|(texel, (_, point))| (texel, ANY_PLACE, point)));
        found.sort_unstable_by_key(|(texel, place, point)| {
            (*texel, distance_of_place(*place), *place, point.triangle)
        });
        let mut out = Self::default();
        let mut last = None;
        for (texel, place, point) in found {
            match last {
                // (A place on an edge belongs to two triangles.)
                Some((known, before)) if known == texel && before == place => continue,
                Some((known, _)) if known == texel => {}
                _ => {
                    let (x, y) = (texel % uvs.size.x, texel / uvs.size.x);
                    out.texels.push([x as u16, y as u16]);
                    out.first.push(out.points.len() as u32);
                }
            }
            last = Some((texel, place));
            out.points.push(point);
            out.places.push(place);
        }
        out.first.push(out.points.len() as u32);
        out
    }

    /// Number of receivers.
    pub fn len(&self) -> usize {
        self.texels.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.texels.is_empty()
    }

    /// The places of a receiver's points.
    pub fn places_of(&self, ix: usize) -> &[u8] {
        &self.places[self.first[ix] as usize..self.first[ix + 1] as usize]
    }

    /// The points of a receiver.
    pub fn points_of(&self, ix: usize) -> &[SurfacePoint] {
        &self.points[self.first[ix] as usize..self.first[ix + 1] as usize]
    }
}

/// Squared distance of a place from the texel's centre, in quarters of its steps: an integer.
fn distance_of_place(place: u8) -> i32 {
    let of = |k: i32| 2 * k + 1 - SIDE as i32;
    let (x, y) = (of(i32::from(place) % SIDE as i32), of(i32::from(place) / SIDE as i32));
    x * x + y * y
}

/// A triangle in the lightmap, of positive area \[texels\].
struct Flat {
    corners: [DVec2; 3],
    area: f64,
}

impl Flat {
    fn new(uvs: &LightmapUvs, ix: usize) -> Self {
        let corners = uvs.corners[ix].map(|corner| corner.as_dvec2());
        let [a, b, c] = corners;
        Self { corners, area: (b - a).perp_dot(c - a) }
    }

    fn bounds(&self) -> (DVec2, DVec2) {
        let [a, b, c] = self.corners;
        (a.min(b).min(c), a.max(b).max(c))
    }

    /// Weights of the second and third corner at a point of the plane.
    fn weights(&self, p: DVec2) -> DVec2 {
        let [a, b, c] = self.corners;
        DVec2::new((p - a).perp_dot(c - a), (b - a).perp_dot(p - a)) / self.area
    }

    /// Calls `each` with the texel, the place in it, and the weights, for the places that it covers.
    fn for_each_place(&self, uvs: &LightmapUvs, mut each: impl FnMut(u32, u8, DVec2)) {
        let (low, high) = self.bounds();
        let side = SIDE as f64;
        let size = uvs.size * SIDE as u32;
        let first = |x: f64| (x * side - 0.5).ceil().max(0.0) as u32;
        let end =
            |x: f64, size: u32| ((x * side - 0.5).floor() + 1.0).clamp(0.0, size.into()) as u32;
        for y in first(low.y)..end(high.y, size.y) {
            for x in first(low.x)..end(high.x, size.x) {
                let at = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) / side;
                let weights = self.weights(at);
                if weights.min_element() >= 0.0 && weights.x + weights.y <= 1.0 {
                    let n = SIDE as u32;
                    let place = (y % n) * n + x % n;
                    each((y / n) * uvs.size.x + x / n, place as u8, weights);
                }
            }
        }
    }

    /// Calls `each` with texels whose squares it touches, and with their centres.
    fn for_each_touched(&self, uvs: &LightmapUvs, mut each: impl FnMut(u32, DVec2)) {
        let (low, high) = self.bounds();
        let first = |x: f64| x.floor().max(0.0) as u32;
        let end = |x: f64, size: u32| (x.floor() + 1.0).clamp(0.0, size.into()) as u32;
        for y in first(low.y)..end(high.y, uvs.size.y) {
            for x in first(low.x)..end(high.x, uvs.size.x) {
                let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                // Separating axes: those of the square are its bounds; those of the edges remain.
                let is_apart = (0..3).any(|k| {
                    let (from, to) = (self.corners[k], self.corners[(k + 1) % 3]);
                    let edge = to - from;
                    let reach = 0.5 * (edge.x.abs() + edge.y.abs());
                    edge.perp_dot(centre - from) < -reach
                });
                if !is_apart {
                    each(y * uvs.size.x + x, centre);
                }
            }
        }
    }

    /// Distance from a point of the plane to the nearest of the triangle, and the weights there.
    fn nearest(&self, p: DVec2) -> (f64, DVec2) {
        let inside = self.weights(p);
        if inside.min_element() >= 0.0 && inside.x + inside.y <= 1.0 {
            return (0.0, inside);
        }
        let on_edge = |k: usize| {
            let (from, to) = (self.corners[k], self.corners[(k + 1) % 3]);
            let edge = to - from;
            let t = ((p - from).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
            from + edge * t
        };
        let points = [on_edge(0), on_edge(1), on_edge(2)];
        let nearest = points
            .into_iter()
            .min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)));
        let nearest = nearest.unwrap_or(self.corners[0]);
        (nearest.distance(p), self.weights(nearest))
    }
}
