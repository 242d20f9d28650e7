// SPDX-License-Identifier: MIT OR Apache-2.0
//! How far away the surfaces around a point are, found by rays on the CPU.

use crate::seam::Surroundings;
use glam::{Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

/// The scene's triangles for rays on the CPU.
pub(super) struct CpuRays {
    tree: CwBvh,
    /// In the order of the tree's leaves.
    triangles: Vec<Triangle>,
}

impl std::fmt::Debug for CpuRays {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "CpuRays of {} triangles", self.triangles.len())
    }
}

/// Number of directions: even if only a third of them hit something, the error of the median is 2 % of the directions.
const N_DIRECTIONS: u32 = 2048;

impl CpuRays {
    /// `triangles`: in the order of the tree's leaves.
    pub fn new(tree: CwBvh, triangles: &[[Vec3; 3]]) -> Self {
        let triangles = triangles
            .iter()
            .map(|&corners| {
                let [a, b, c] = corners.map(Vec3A::from);
                Triangle { v0: a, v1: b, v2: c }
            })
            .collect();
        Self { tree, triangles }
    }

    /// The box around all triangles in a box, or around the parts of their boxes that lie in it; None if there are
    /// none.
    pub fn bounds_within(&self, (low, high): (Vec3, Vec3)) -> Option<(Vec3, Vec3)> {
        let mut found: Option<(Vec3, Vec3)> = None;
        for triangle in &self.triangles {
            let corners = [triangle.v0, triangle.v1, triangle.v2].map(Vec3::from);
            let min = corners.into_iter().fold(Vec3::MAX, Vec3::min).max(low);
            let max = corners.into_iter().fold(Vec3::MIN, Vec3::max).min(high);
            if min.cmple(max).all() {
                let (least, greatest) = found.unwrap_or((min, max));
                found = Some((least.min(min), greatest.max(max)));
            }
        }
        found
    }

    /// The surroundings of a point, without alpha masks; None if no direction hits anything.
    pub fn around(&self, point: Vec3) -> Option<Surroundings> {
        if self.triangles.is_empty() {
            return None;
        }
        let mut distances: Vec<f32> = (0..N_DIRECTIONS)
            .filter_map(|ix| {
                let ray = Ray::new_inf(point.into(), direction(ix).into());
                let mut hit = RayHit::none();
                let triangle = |ray: &Ray, ix: usize| self.triangles[ix].intersect(ray);
                self.tree.ray_traverse(ray, &mut hit, triangle).then_some(hit.t)
            })
            .filter(|distance| distance.is_finite() && *distance > 0.0)
            .collect();
        distances.sort_unstable_by(f32::total_cmp);
        let median = *distances.get(distances.len() / 2)?;
        Some(Surroundings { median, farthest: *distances.last()? })
    }
}

/// One of [`N_DIRECTIONS`] evenly spread directions: a Fibonacci lattice on the sphere (R. Swinbank, R. Purser, 2006).
fn direction(ix: u32) -> Vec3 {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let z = 1.0 - (2.0 * f64::from(ix) + 1.0) / f64::from(N_DIRECTIONS);
    let (sin, cos) = (GOLDEN_ANGLE * f64::from(ix)).sin_cos();
    let radius = (1.0 - z * z).sqrt();
    glam::DVec3::new(radius * cos, radius * sin, z).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu_scene::build_obvhs;

    /// In a closed cube of half side 1 the median distance d solves: the sphere of radius d has half of its surface inside. Each
    /// of six caps has (1 − 1/d)/2 of it, apart while d < √2: 3·(1 − 1/d) = ½, d = 1.2.
    #[test]
    fn a_cube_around() {
        let corner = |bits: u32| {
            Vec3::from([0, 1, 2].map(|axis| if bits >> axis & 1 == 1 { 1.0 } else { -1.0 }))
        };
        let mut triangles = Vec::new();
        for face in
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
        {
            let [a, b, c, d] = face.map(corner);
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let tree = build_obvhs(&triangles);
        let order: Vec<_> =
            tree.primitive_indices.iter().map(|&ix| triangles[ix as usize]).collect();
        let found = CpuRays::new(tree, &order).around(Vec3::ZERO).unwrap();
        assert!((found.median - 1.2).abs() < 0.01, "{found:?}");
        assert!(found.farthest <= 3f32.sqrt() && found.farthest > 1.7, "{found:?}");
        let rays = CpuRays::new(build_obvhs(&order), &order);
        assert_eq!(
            rays.bounds_within((Vec3::splat(-0.5), Vec3::new(0.5, 0.5, 9.0))),
            Some((Vec3::new(-0.5, -0.5, 1.0), Vec3::new(0.5, 0.5, 1.0)))
        );
        assert_eq!(rays.bounds_within((Vec3::splat(-0.5), Vec3::splat(0.5))), None);
        assert_eq!(CpuRays::new(CwBvh::default(), &[]).around(Vec3::ZERO), None);
    }
}
