// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a bake of sparse probes decides before it computes transport: receivers, probes, clusters.

use super::settings::{EVEN_NEAR, LEAST_NEAR, LEAST_SEEING, SparseSettings, Support};
use crate::bindings::kernels::sparse_probes::transport::MAX_NEAR;
use crate::bindings::lucerna::components::sparse_probes::lit_receiver::LIT_POINTS;
use crate::bindings::lucerna::components::sparse_probes::seen::SEEN_UNKNOWN;
use crate::components::lightmap::{LightmapUvs, NO_CHART, Receivers, SurfacePoint};
use crate::scene::SceneFingerprint;
use crate::seam::StaticMesh;
use glam::{UVec2, Vec2, Vec3};
use std::ops::Range;

pub use crate::bindings::lucerna::components::sparse_probes::receiver::Receiver;

/// The 4 × 4 places of a texel, in an order in which each quarter, row and column of it has one of the first four; the first is that of the point that stands
/// for most receivers.
const SPREAD: [u8; 16] = [5, 3, 8, 14, 10, 12, 7, 1, 0, 6, 13, 11, 15, 9, 2, 4];

/// Everything that a bake of sparse probes decides before it computes transport.
#[derive(Clone, Debug, PartialEq)]
pub struct SparsePlan {
    /// The scene that it is for.
    pub scene: SceneFingerprint,
    /// Its settings.
    pub settings: SparseSettings,
    /// Within which probes count for most receivers \[m\].
    pub radius: f32,
    /// A hash of the places that probes were given; 0: they were placed by themselves.
    pub placed: u64,
    /// Width and height of the lightmap \[texels\].
    pub size: UVec2,
    /// Of all charts \[texels/m\].
    pub texels_per_metre: f32,
    /// Of each triangle, in the order of the meshes, its corners' places in the lightmap \[texels\].
    pub corners: Vec<[Vec2; 3]>,
    /// Where the probes are \[m\].
    pub probes: Vec<Vec3>,
    /// In the order of their clusters. Triangles are in the order of the meshes.
    pub receivers: Vec<Receiver>,
    /// Of each receiver, within which probes count \[m\].
    pub radii: Vec<f32>,
    /// Of each receiver, two masks: in the low half, which of the 4 × 4 places of its texel are on its side of whatever cuts through the texel; in the high
    /// half, which of the eight texels around it are (row by row from the upper left one).
    pub reach: Vec<u32>,
    /// Where the receivers of each cluster begin; one more, where the last one's end.
    pub clusters: Vec<u32>,
    /// For each direction of each probe, what it sees (`wgsl/kernels/sparse_probes/look.wgsl`).
    pub seen: Vec<u32>,
    /// Samples of the surfaces that receivers see that were tried when probes were placed, and those of them that no probe sees.
    pub coverage: [u32; 2],
}

/// A hash of places that probes were given, never 0: by it, a bake that was begun is known again.
pub fn hash_of_places(points: &[Vec3]) -> u64 {
    let bytes: Vec<u8> =
        points.iter().flat_map(|at| at.to_array()).flat_map(f32::to_le_bytes).collect();
    xxhash_rust::xxh3::xxh3_64(&bytes).max(1)
}

/// Static surfaces, with the points that texels stand for.
#[derive(Clone, Debug)]
pub struct SparseSurfaces {
    /// Corners of all triangles of the meshes, in their order \[m\].
    pub corners: Vec<[Vec3; 3]>,
    /// Of the whole lightmap.
    points: Receivers,
    /// For each texel of the lightmap, its place in `points`; `u32::MAX`: none.
    place_of_texel: Vec<u32>,
    size: UVec2,
}

impl SparseSurfaces {
    /// Of a lightmap.
    pub fn new(meshes: &[StaticMesh], size: UVec2, corners: &[[Vec2; 3]]) -> Self {
        let charts =
            corners.iter().map(|of| if of[0] == of[1] && of[0] == of[2] { NO_CHART } else { 0 });
        let uvs = LightmapUvs {
            size,
            corners: corners.to_vec(),
            charts: charts.collect(),
            ..LightmapUvs::default()
        };
        let points = Receivers::of(&uvs);
        let mut place_of_texel = vec![u32::MAX; (size.x * size.y) as usize];
        for (ix, [x, y]) in points.texels.iter().enumerate() {
            place_of_texel[usize::from(*y) * size.x as usize + usize::from(*x)] = ix as u32;
        }
        Self { corners: corners_of(meshes), points, place_of_texel, size }
    }

    /// All texels that surfaces meet.
    pub fn texels(&self) -> &Receivers {
        &self.points
    }

    /// The points of surfaces in a receiver's texel; the first one stands for it.
    pub fn points_of(&self, receiver: &Receiver) -> &[SurfacePoint] {
        self.find(receiver).map_or(&[], |ix| self.points.points_of(ix))
    }

    /// Where in the texel each of [`Self::points_of`] is.
    pub fn places_of(&self, receiver: &Receiver) -> &[u8] {
        self.find(receiver).map_or(&[], |ix| self.points.places_of(ix))
    }

    /// Its texel's place in `points`; None: no chart touches it.
    fn find(&self, receiver: &Receiver) -> Option<usize> {
        let (x, y) = (receiver.texel & 0xffff, receiver.texel >> 16);
        let place = self.place_of_texel[(y * self.size.x + x) as usize];
        (place != u32::MAX).then_some(place as usize)
    }

    /// Those of [`Self::points_of`] that a mask of [`SparsePlan::reach`] leaves.
    pub fn points_within(&self, receiver: &Receiver, reach: u32) -> Vec<SurfacePoint> {
        let is_within =
            |(_, place): &(&SurfacePoint, &u8)| **place > 15 || reach >> **place & 1 == 1;
        let points = self.points_of(receiver).iter().zip(self.places_of(receiver));
        points.filter(is_within).map(|(point, _)| *point).collect()
    }

    /// The points of a receiver that are lit, spread over its texel, the one that stands for it first; if there are fewer, they repeat. (A file may have receivers
    /// where no chart is: these have that point alone.)
    pub fn lit_points(
        &self,
        receiver: &Receiver,
        reach: u32,
    ) -> [SurfacePoint; LIT_POINTS as usize] {
        let own = SurfacePoint { triangle: receiver.triangle, weights: receiver.weights };
        let mut out = vec![own];
        if let Some(texel) = self.find(receiver) {
            let (points, places) = (self.points.points_of(texel), self.points.places_of(texel));
            let at = |place: &u8| {
                let ix = places.iter().position(|of| of == place)?;
                (reach >> place & 1 == 1).then_some(points[ix])
            };
            out.extend(SPREAD.iter().filter_map(at).filter(|of| *of != own));
        }
        std::array::from_fn(|k| out[k % out.len().min(LIT_POINTS as usize)])
    }

    /// The point that stands for a receiver, so far off the surface \[m\], on the receiver's side.
    pub fn anchor(&self, of: &Receiver, lift: f32) -> Vec3 {
        self.position(of) + lift * self.normal(of)
    }

    /// Where a receiver is \[m\].
    pub fn position(&self, receiver: &Receiver) -> Vec3 {
        let point = SurfacePoint { triangle: receiver.triangle, weights: receiver.weights };
        point.position(&self.corners[receiver.triangle as usize])
    }

    /// The normal of a receiver's triangle, on its side.
    pub fn normal(&self, receiver: &Receiver) -> Vec3 {
        let [a, b, c] = self.corners[receiver.triangle as usize].map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        if receiver.side == 0 { normal } else { -normal }
    }
}

fn corners_of(meshes: &[StaticMesh]) -> Vec<[Vec3; 3]> {
    let of = |mesh: &StaticMesh| -> Vec<[Vec3; 3]> {
        mesh.triangles.iter().map(|t| t.map(|ix| mesh.positions[ix as usize])).collect()
    };
    meshes.iter().flat_map(of).collect()
}

impl SparsePlan {
    /// The receivers of a cluster.
    pub fn receivers_of(&self, cluster: usize) -> Range<usize> {
        self.clusters[cluster] as usize..self.clusters[cluster + 1] as usize
    }

    /// In how many of the directions in which probes look they see surfaces without texels.
    pub fn n_unknown(&self) -> usize {
        self.seen.iter().filter(|what| **what == SEEN_UNKNOWN).count()
    }

    /// Whether each receiver has one of another cluster beside it in the lightmap.
    pub fn borders(&self) -> Vec<bool> {
        let n_texels = (self.size.x * self.size.y) as usize;
        let place = |texel: u32, side: u32, [dx, dy]: [i32; 2]| {
            let (x, y) = ((texel & 0xffff) as i32 + dx, (texel >> 16) as i32 + dy);
            let is_inside = x >= 0 && y >= 0 && x < self.size.x as i32 && y < self.size.y as i32;
            is_inside
                .then(|| side as usize * n_texels + (y as u32 * self.size.x + x as u32) as usize)
        };
        let mut cluster_at = vec![u32::MAX; 2 * n_texels];
        for cluster in 0..self.n_clusters() {
            for receiver in &self.receivers[self.receivers_of(cluster)] {
                if let Some(at) = place(receiver.texel, receiver.side, [0, 0]) {
                    cluster_at[at] = cluster as u32;
                }
            }
        }
        let is_border = |receiver: &Receiver, own: u32| {
            (0..9).any(|k| {
                let at = place(receiver.texel, receiver.side, [k % 3 - 1, k / 3 - 1]);
                let other = at.map_or(u32::MAX, |at| cluster_at[at]);
                other != u32::MAX && other != own
            })
        };
        (0..self.n_clusters())
            .flat_map(|cluster| self.receivers_of(cluster).map(move |ix| (ix, cluster as u32)))
            .map(|(ix, cluster)| is_border(&self.receivers[ix], cluster))
            .collect()
    }

    /// Number of clusters.
    pub fn n_clusters(&self) -> usize {
        self.clusters.len().saturating_sub(1)
    }

    /// Probes that count for a receiver at a place, with their weights; the nearest ones, if there are too many.
    pub fn near(&self, position: Vec3, radius: f32) -> Vec<(u32, f32)> {
        let mut near: Vec<(u32, f32)> = (0u32..)
            .zip(&self.probes)
            .map(|(ix, probe)| (ix, support_weight(probe.distance(position), radius)))
            .filter(|(_, weight)| *weight > 0.0)
            .collect();
        if near.len() > MAX_NEAR as usize {
            near.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            near.truncate(MAX_NEAR as usize);
            near.sort_by_key(|of| of.0);
        }
        near
    }
}

/// w(t) = 2t³ − 3t² + 1, as `wgsl/components/sparse_probes/support.wgsl`.
pub(super) fn support_weight(distance: f32, radius: f32) -> f32 {
    let t = (distance / radius).min(1.0);
    (2.0 * t - 3.0) * t * t + 1.0
}

/// How many probes that see a receiver count for it at least, if there are so many.
pub(crate) fn least_seeing(support: Support) -> usize {
    match support {
        Support::Fixed => LEAST_SEEING,
        Support::Even => EVEN_NEAR,
    }
}

/// Within which probes count, for a receiver at a place. `seen`: distances of probes that see it, in order; where these are too few, others count
/// as well: it may be in a corner that sees what they see.
pub(crate) fn radius_at(
    position: Vec3,
    probes: &[Vec3],
    seen: &[f32],
    radius: f32,
    support: Support,
) -> f32 {
    let last = seen.get(least_seeing(support) - 1).copied().unwrap_or_else(|| {
        let mut distances: Vec<f32> = probes.iter().map(|probe| probe.distance(position)).collect();
        distances.sort_by(f32::total_cmp);
        let n = least_seeing(support).max(LEAST_NEAR);
        let nearest = distances.get(n - 1).or(distances.last()).copied().unwrap_or(0.0);
        seen.last().map_or(nearest, |of| of.max(nearest))
    });
    // (A little farther than the last one, so that it counts.)
    match support {
        Support::Fixed => radius.max(1.1 * last),
        Support::Even => 1.1 * last,
    }
}

/// Divides receivers into clusters: boxes are halved across their longest axis until none has too many. Returns the receivers' new order, and where
/// clusters begin.
pub(crate) fn clustered(positions: &[Vec3], most: usize) -> (Vec<u32>, Vec<u32>) {
    let mut order: Vec<u32> = (0..positions.len() as u32).collect();
    let mut first = vec![0];
    divide(positions, &mut order, most.max(1), &mut first);
    (order, first)
}

fn divide(positions: &[Vec3], order: &mut [u32], most: usize, first: &mut Vec<u32>) {
    let at = |ix: &u32| positions[*ix as usize];
    let (low, high) = order
        .iter()
        .map(at)
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), at| (low.min(at), high.max(at)));
    if order.len() <= most {
        let begin = first.last().copied().unwrap_or(0);
        if !order.is_empty() {
            first.push(begin + order.len() as u32);
        }
        return;
    }
    let axis = (high - low).max_position();
    let middle = 0.5 * (low[axis] + high[axis]);
    // (Stable, so that the result does not depend on how it is sorted.)
    order.sort_by_key(|ix| at(ix)[axis] >= middle);
    let n_low = order.iter().filter(|ix| at(ix)[axis] < middle).count();
    // (All in one place: anywhere.)
    let cut = if n_low == 0 || n_low == order.len() { order.len() / 2 } else { n_low };
    let (a, b) = order.split_at_mut(cut);
    divide(positions, a, most, first);
    divide(positions, b, most, first);
}
