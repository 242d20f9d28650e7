// SPDX-License-Identifier: MIT OR Apache-2.0
//! Where a net's probes could be: rules that look at a scene's voxels, fewer of many points, and more where cells are slivers.

use super::{NetError, NetKind, ProbeNet};
use crate::bindings::kernels::probe_net::inspect as wgsl;
use crate::components::voxels::{VoxelGrid, n_bricks};
use crate::gpu::{ComputeKernel, Dispatch, Gpu, Recorder, Shaders};
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::{IVec3, UVec3, Vec3};
use std::collections::HashSet;

pub use crate::bindings::kernels::probe_net::inspect::Inspected;

/// Where the probes of a net are.
#[derive(Clone, Debug, PartialEq)]
pub enum NetRule {
    /// In the middle of empty voxels beside occupied ones (M. Valient, "Taking Killzone Shadow Fall image quality into the next generation",
    /// GDC 2014).
    Surfaces,
    /// This high \[m\] above floors and whatever else one could stand on, or, under a low ceiling, half-way to it. On one even floor
    /// they are in a plane.
    Ground {
        /// Above 0 \[m\].
        height: f32,
    },
    /// At these points \[m\].
    Points(Vec<Vec3>),
}

/// How a net is made for a scene.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NetSettings {
    /// Where probes are.
    pub rule: NetRule,
    /// Edge of a voxel \[m\]: about how far probes are from each other. 0: an edge of 1/16 of the longest side of the scene's box.
    pub spacing: f32,
    /// The most probes. If the rule has more, those stay that are farthest from each other.
    pub most: u32,
    /// Whether cells that are slivers get more probes.
    pub fills: bool,
}

impl Default for NetSettings {
    fn default() -> Self {
        Self { rule: NetRule::Surfaces, spacing: 0.0, most: 4096, fills: true }
    }
}

/// A net that was made for a scene, and what was left out.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PlacedNet {
    /// The net.
    pub net: ProbeNet,
    /// Points of the rule that are inside something, or behind a wall.
    pub n_inside: u32,
    /// Points of the rule that were too many.
    pub n_too_many: u32,
    /// Probes that were added where cells were slivers.
    pub n_fillers: u32,
    /// Cells that still are.
    pub n_slivers: u32,
}

/// Cells whose circumscribed circle (sphere) is larger than this many of their shortest edges are slivers. (2 is where Delaunay refinement
/// is sure to end: J. R. Shewchuk, "Tetrahedral Mesh Generation by Delaunay Refinement", SCG 1998.)
const SLIVER: f64 = 2.0;

impl ProbeNet {
    /// Cells (triangles in a plane) that are slivers: the middles of their longest edges \[m\], the worst cell first, and each once.
    pub fn slivers(&self) -> Vec<Vec3> {
        let at = |v: u32| self.points[v as usize].as_dvec3();
        let mut known = HashSet::new();
        let is_new =
            |of: &&(f64, [u32; 2])| known.insert([of.1[0].min(of.1[1]), of.1[0].max(of.1[1])]);
        let middle = |of: &(f64, [u32; 2])| ((at(of.1[0]) + at(of.1[1])) * 0.5).as_vec3();
        self.judged().iter().filter(is_new).map(middle).collect()
    }

    /// How many cells (triangles in a plane) are slivers.
    pub fn n_slivers(&self) -> u32 {
        self.judged().len() as u32
    }

    /// The slivers: how many times their shortest edge the circumscribed radius is, the largest first, and their longest edges.
    fn judged(&self) -> Vec<(f64, [u32; 2])> {
        let at = |v: u32| self.points[v as usize].as_dvec3();
        let mut found: Vec<(f64, [u32; 2])> = Vec::new();
        let mut judge = |corners: &[u32]| {
            let mut edges = Vec::new();
            for (ix, &a) in corners.iter().enumerate() {
                edges.extend(corners[ix + 1..].iter().map(|&b| (at(a).distance(at(b)), [a, b])));
            }
            let by_length = |x: &&(f64, [u32; 2]), y: &&(f64, [u32; 2])| x.0.total_cmp(&y.0);
            let shortest = edges.iter().min_by(by_length).map_or(0.0, |of| of.0);
            let longest = *edges.iter().max_by(by_length).unwrap_or(&(0.0, [0, 0]));
            // (No circle around the longest edge is smaller; a flat cell has none, and is judged by that.)
            let radius = circumradius(&corners.iter().map(|v| at(*v)).collect::<Vec<_>>())
                .filter(|radius| *radius < longest.0 * 4.0)
                .unwrap_or(0.5 * longest.0);
            let ratio = radius / shortest;
            if ratio > SLIVER {
                found.push((ratio, longest.1));
            }
        };
        match self.kind {
            NetKind::Space => self.cells.iter().for_each(|cell| judge(&cell.vertices)),
            NetKind::Plane => self.faces.iter().step_by(2).for_each(|face| judge(&face.vertices)),
            _ => {}
        }
        found.sort_by(|x, y| y.0.total_cmp(&x.0));
        found
    }
}

/// The radius of the sphere (circle) through the corners of a tetrahedron (triangle). None if it is flat.
fn circumradius(corners: &[glam::DVec3]) -> Option<f64> {
    let (a, b) = (corners[1] - corners[0], corners[2] - corners[0]);
    let of = |numerator: glam::DVec3, denominator: f64| {
        let radius = numerator.length() / denominator.abs();
        radius.is_finite().then_some(radius)
    };
    let Some(&last) = corners.get(3) else {
        let normal = a.cross(b);
        let numerator = (a * b.length_squared() - b * a.length_squared()).cross(normal);
        return of(numerator, 2.0 * normal.length_squared());
    };
    let c = last - corners[0];
    let numerator = a.length_squared() * b.cross(c)
        + b.length_squared() * c.cross(a)
        + c.length_squared() * a.cross(b);
    of(numerator, 2.0 * a.dot(b.cross(c)))
}

/// The empty cells of a grid beside which surfaces are.
#[derive(Debug)]
pub(crate) struct Candidates {
    grid: VoxelGrid,
    occupied: HashSet<IVec3>,
}

impl Candidates {
    /// Of a structure that was read back (`wgsl/components/voxels/bricks.wgsl`).
    pub fn of_voxels(grid: VoxelGrid, structure: &[[u32; 2]], n_voxels: u32) -> Self {
        let first = n_bricks(&grid) as usize;
        let voxels = &structure[first..first + n_voxels as usize];
        let cell = |[packed, _]: &[u32; 2]| {
            UVec3::new(packed & 1023, packed >> 10 & 1023, packed >> 20).as_ivec3()
        };
        Self { grid, occupied: voxels.iter().map(cell).collect() }
    }

    fn middles(&self, mut cells: Vec<IVec3>) -> Vec<Vec3> {
        cells.sort_unstable_by_key(|cell| (cell.z, cell.y, cell.x));
        cells.dedup();
        let inside = |cell: &IVec3| {
            cell.cmpge(IVec3::ZERO).all() && cell.cmplt(self.grid.size.as_ivec3()).all()
        };
        cells.retain(|cell| inside(cell) && !self.occupied.contains(cell));
        cells
            .iter()
            .map(|cell| self.grid.origin + (cell.as_vec3() + 0.5) * self.grid.cell)
            .collect()
    }

    /// The middles of the empty cells that share a corner with one that surfaces meet \[m\].
    pub fn beside_surfaces(&self) -> Vec<Vec3> {
        let around = |cell: &IVec3| {
            let cell = *cell;
            (0..27).map(move |ix| cell + IVec3::new(ix % 3, ix / 3 % 3, ix / 9) - 1)
        };
        self.middles(self.occupied.iter().flat_map(around).collect())
    }

    /// The middles of the empty cells above one that surfaces meet \[m\].
    pub fn above_surfaces(&self) -> Vec<Vec3> {
        self.middles(self.occupied.iter().map(|cell| *cell + IVec3::Y).collect())
    }
}

/// At most `most` of some points: those that are farthest from the ones before, from the first on (T. F. Gonzalez, "Clustering to minimize
/// the maximum intercluster distance", 1985). In their order.
fn thinned(points: Vec<Vec3>, most: usize) -> Vec<Vec3> {
    if points.len() <= most {
        return points;
    }
    let mut apart = vec![f32::INFINITY; points.len()];
    let mut is_kept = vec![false; points.len()];
    let mut next = 0;
    for _ in 0..most {
        is_kept[next] = true;
        let (mut farthest, mut at) = (-1.0, 0);
        for (ix, point) in points.iter().enumerate() {
            apart[ix] = apart[ix].min(point.distance_squared(points[next]));
            if apart[ix] > farthest {
                (farthest, at) = (apart[ix], ix);
            }
        }
        next = at;
    }
    points
        .into_iter()
        .zip(is_kept)
        .filter_map(|(point, is_kept)| is_kept.then_some(point))
        .collect()
}

/// The kernel `probe_net/inspect`: what is around points.
#[derive(Debug)]
pub struct InspectPass {
    kernel: ComputeKernel,
    shaders: Shaders,
}

impl InspectPass {
    /// Compiles the kernel for scenes of the same variant.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Self {
        let kernel =
            ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), "probe_net/inspect");
        Self { kernel, shaders: scene.shaders().clone() }
    }

    /// Records the look around `n` points, at least 1, by rays of at most `most` \[m\]. `points`: `array<vec4<f32>>` \[m\]; `inspected`: as
    /// many [`Inspected`].
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        (points, inspected): (&wgpu::Buffer, &wgpu::Buffer),
        n: u32,
        most: f32,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        let info = wgsl::InspectInfo { n_points: n, most, reserved_a: 0, reserved_b: 0 };
        self.kernel
            .call(&mut recorder.compute(self.kernel.name()))
            .scene(scene.group())
            .uniform("info", &info)
            .bind("points", points)
            .bind("inspected", inspected)
            .dispatch(Dispatch::Items(n * wgsl::WORKGROUP));
        Ok(())
    }
}

impl PlacedNet {
    /// A net of points of which `n_inside` and `n_too_many` were left out. `is_free` says which of some points are not inside anything.
    ///
    /// # Errors
    /// [`NetError`], or what `is_free` returns.
    pub(crate) fn of<E: From<NetError>>(
        points: Vec<Vec3>,
        settings: &NetSettings,
        mut is_free: impl FnMut(&[Vec3]) -> Result<Vec<bool>, E>,
    ) -> Result<Self, E> {
        let n_all = points.len();
        let is_kept = is_free(&points)?;
        let free: Vec<Vec3> = points
            .into_iter()
            .zip(is_kept)
            .filter_map(|(p, is_free)| is_free.then_some(p))
            .collect();
        let n_free = free.len();
        let mut points = thinned(free, settings.most as usize);
        let mut out = Self {
            net: ProbeNet::new(&points)?,
            n_inside: (n_all - n_free) as u32,
            n_too_many: (n_free - points.len()) as u32,
            n_fillers: 0,
            n_slivers: 0,
        };
        // (No nearer to each other than this, so that it ends.)
        let least = 0.25 * out.net.unit();
        let mut refused: HashSet<[u32; 3]> = HashSet::new();
        loop {
            let middles = out.net.slivers();
            out.n_slivers = out.net.n_slivers();
            if !settings.fills {
                return Ok(out);
            }
            let room = (settings.most as usize).saturating_sub(points.len());
            let mut added: Vec<Vec3> = Vec::new();
            for middle in middles {
                let is_near = |p: &Vec3| p.distance(middle) < least;
                let is_refused = refused.contains(&middle.to_array().map(f32::to_bits));
                if !is_refused && !added.iter().any(is_near) && !points.iter().any(is_near) {
                    added.push(middle);
                }
            }
            added.truncate(room);
            if added.is_empty() {
                return Ok(out);
            }
            let is_kept = is_free(&added)?;
            let mut more = points.clone();
            for (point, is_free) in added.into_iter().zip(is_kept) {
                if is_free {
                    more.push(point);
                } else {
                    refused.insert(point.to_array().map(f32::to_bits));
                }
            }
            // (A net without fillers is better than none.)
            match ProbeNet::new(&more) {
                Ok(net) => out.net = net,
                Err(_) => return Ok(out),
            }
            out.n_fillers += (more.len() - points.len()) as u32;
            points = more;
        }
    }
}
