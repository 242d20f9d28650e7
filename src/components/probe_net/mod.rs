// SPDX-License-Identifier: MIT OR Apache-2.0
//! Nets of probes at any places: tetrahedra in space, or triangles in a plane, between which light is interpolated.
//!
//! ```text
//! points ──▶ ProbeNet (host): Delaunay cells, faces of the hull, a grid of cells to start at
//!               │ upload
//!               ▼
//!            NetBuffers ──▶ fields::probe_net: from the start, walk from cell to cell; four probes and their weights
//! ```
//!
//! R. Cupisz, "Light probe interpolation using tetrahedral tessellations", GDC 2012; M. Valient, "Taking Killzone Shadow Fall image
//! quality into the next generation", GDC 2014. Outside the hull, where those extrapolate, a point gets the light of the
//! nearest point of the hull: that is continuous, and never farther off than what probes have found.

mod delaunay;
mod placement;

use crate::bindings::lucerna::fields::probe_net as wgsl;
use crate::gpu::{
    Bindings, ComputeKernel, Dispatch, Gpu, GpuError, Recorder, Shaders, buffer, storage_buffer,
};
use glam::{DVec2, DVec3, UVec3, Vec3};
use std::collections::HashMap;

pub(crate) use placement::Candidates;
pub use placement::{InspectPass, Inspected, NetRule, NetSettings, PlacedNet};

/// Set in a neighbour's index: a face of the hull, not a cell.
pub const OUTSIDE: u32 = 0x8000_0000;
/// Points that are nearer to a plane or a line than this share of their extent are on it.
const FLAT: f64 = 1e-6;
/// Cells for each cell of the grid of starts, about.
const CELLS_PER_START: f64 = 4.0;
/// The most cells of the grid of starts along an axis.
const MOST_STARTS: u32 = 32;
const ADVICE: &str = "use fewer probes";

/// A tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct NetCell {
    /// Its corners: indices of points.
    pub vertices: [u32; 4],
    /// What lies across the face that is opposite to each corner: a cell, or `OUTSIDE` with a face of the hull.
    pub neighbours: [u32; 4],
}

/// A triangle of the hull, or of one side of a plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct NetFace {
    /// Its corners, counter-clockwise from outside.
    pub vertices: [u32; 3],
    /// The cell behind it; `OUTSIDE`: there is none.
    pub cell: u32,
    /// The faces across the edges from each corner to the next.
    pub neighbours: [u32; 3],
    /// 0
    pub reserved: u32,
}

/// What a net's points span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NetKind {
    /// No points.
    Empty,
    /// One point: its light is everywhere.
    Point,
    /// Points on a line, in its order.
    Line,
    /// Points in a plane: triangles. What is above or below gets the light of the nearest point.
    Plane,
    /// Tetrahedra.
    Space,
}

/// A net is not possible.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetError {
    /// A point is not finite.
    #[error("point {0} is not finite")]
    NotFinite(usize),
    /// There are more than indices can tell apart.
    #[error("{0} points are too many: a net has at most 2^24")]
    TooMany(usize),
    /// The crate did not give a valid triangulation.
    #[error("the points could not be triangulated: {0}; please report them")]
    Triangulation(String),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// A net, on the host.
#[derive(Clone, Debug)]
pub struct ProbeNet {
    points: Vec<Vec3>,
    kind: NetKind,
    cells: Vec<NetCell>,
    faces: Vec<NetFace>,
    n_duplicates: usize,
    start_origin: Vec3,
    start_size: UVec3,
    start_cell: Vec3,
    starts: Vec<u32>,
}

impl ProbeNet {
    /// The net of these points \[m\]. Points at the same place become one; [`Self::n_duplicates`] says how many were left out.
    ///
    /// # Errors
    /// [`NetError`] other than `Gpu`.
    pub fn new(points: &[Vec3]) -> Result<Self, NetError> {
        if points.len() > 1 << 24 {
            return Err(NetError::TooMany(points.len()));
        }
        if let Some(ix) = points.iter().position(|point| !point.is_finite()) {
            return Err(NetError::NotFinite(ix));
        }
        let mut known = HashMap::new();
        let mut unique: Vec<Vec3> = Vec::new();
        for &point in points {
            // (Both zeros are the same place.)
            let point = point + Vec3::ZERO;
            known.entry(point.to_array().map(f32::to_bits)).or_insert_with(|| unique.push(point));
        }
        let mut made = Self {
            n_duplicates: points.len() - unique.len(),
            points: unique,
            kind: NetKind::Empty,
            cells: Vec::new(),
            faces: Vec::new(),
            start_origin: Vec3::ZERO,
            start_size: UVec3::ONE,
            start_cell: Vec3::ONE,
            starts: vec![OUTSIDE],
        };
        made.connect()?;
        made.find_starts();
        Ok(made)
    }

    fn connect(&mut self) -> Result<(), NetError> {
        let exact: Vec<DVec3> = self.points.iter().map(|point| point.as_dvec3()).collect();
        let Some(&a) = exact.first() else { return Ok(()) };
        let farthest = |of: &dyn Fn(DVec3) -> f64| {
            let pair = |p: &DVec3| (of(*p), *p);
            exact
                .iter()
                .map(pair)
                .fold((0.0, a), |best, next| if next.0 > best.0 { next } else { best })
        };
        let (extent, b) = farthest(&|p| p.distance(a));
        self.kind = NetKind::Point;
        if extent == 0.0 {
            return Ok(());
        }
        // f32 cannot say more exactly where points far from the origin are.
        let most = exact.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let flat = (FLAT * extent).max(4.0 * f64::from(f32::EPSILON) * most);
        let along = (b - a) / extent;
        let from_line = |p: DVec3| (p - a) - along * (p - a).dot(along);
        let (width, c) = farthest(&|p| from_line(p).length());
        if width <= flat {
            self.kind = NetKind::Line;
            let mut order: Vec<(f64, Vec3)> =
                exact.iter().zip(&self.points).map(|(p, of)| ((*p - a).dot(along), *of)).collect();
            order.sort_by(|x, y| x.0.total_cmp(&y.0));
            self.points = order.into_iter().map(|(_, of)| of).collect();
            return Ok(());
        }
        let across = from_line(c).normalize();
        let normal = along.cross(across);
        let (height, _) = farthest(&|p| (p - a).dot(normal).abs());
        if height <= flat {
            self.kind = NetKind::Plane;
            let in_plane = |p: &DVec3| DVec2::new((*p - a).dot(along), (*p - a).dot(across));
            self.faces = delaunay::in_plane(&exact.iter().map(in_plane).collect::<Vec<_>>(), flat)?;
            return Ok(());
        }
        self.kind = NetKind::Space;
        (self.cells, self.faces) = delaunay::in_space(&exact, flat)?;
        Ok(())
    }

    /// Cells, or faces, to begin a walk at, for a grid over the box of the points.
    fn find_starts(&mut self) {
        let (n, reduce) = (self.cells.len().max(self.faces.len()), |f: fn(Vec3, Vec3) -> Vec3| {
            self.points.iter().copied().reduce(f).unwrap_or(Vec3::ZERO)
        });
        let (low, high) = (reduce(Vec3::min), reduce(Vec3::max));
        if self.faces.is_empty() {
            return;
        }
        let extent = (high - low).max(Vec3::splat(1e-30));
        let side =
            (f64::from(extent.x) * f64::from(extent.y) * f64::from(extent.z) * CELLS_PER_START
                / n as f64)
                .cbrt();
        let longest = f64::from(extent.max_element());
        let side = side.max(longest / f64::from(MOST_STARTS)) as f32;
        self.start_size =
            (extent / side).ceil().as_uvec3().clamp(UVec3::ONE, UVec3::splat(MOST_STARTS));
        self.start_cell = extent / self.start_size.as_vec3();
        self.start_origin = low;
        let mut starts = Vec::new();
        let mut last = if self.cells.is_empty() { OUTSIDE } else { 0 };
        for ix in 0..self.start_size.element_product() {
            let UVec3 { x, y, .. } = self.start_size;
            let cell = UVec3::new(ix % x, ix / x % y, ix / (x * y)).as_vec3();
            let middle = (low + (cell + 0.5) * self.start_cell).as_dvec3();
            last = match self.kind {
                NetKind::Plane => OUTSIDE | self.nearest_face(middle),
                _ => self.walk(middle, last),
            };
            starts.push(last);
        }
        self.starts = starts;
    }

    /// The face whose middle is nearest.
    fn nearest_face(&self, at: DVec3) -> u32 {
        let middle = |face: &NetFace| {
            face.vertices.map(|v| self.points[v as usize].as_dvec3()).iter().sum::<DVec3>() / 3.0
        };
        let apart = |face: &NetFace| middle(face).distance_squared(at);
        let nearest =
            self.faces.iter().enumerate().min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
        nearest.map_or(0, |(ix, _)| ix as u32)
    }

    /// The cell that a point is in, by exact signs, or the face of the hull through which the walk left.
    fn walk(&self, at: DVec3, start: u32) -> u32 {
        let mut now = start;
        if now & OUTSIDE != 0 {
            match self.faces[(now & !OUTSIDE) as usize].cell {
                // (A plane has no cells.)
                OUTSIDE => return now,
                cell => now = cell,
            }
        }
        for _ in 0..self.cells.len() {
            let cell = &self.cells[now as usize];
            let corner = |k: usize| self.points[cell.vertices[k] as usize].as_dvec3();
            let corners = [0, 1, 2, 3].map(corner);
            let behind = (0..4).find(|&k| {
                let mut moved = corners;
                moved[k] = at;
                delaunay::orientation(moved) < 0.0
            });
            match behind {
                None => return now,
                Some(k) if cell.neighbours[k] & OUTSIDE != 0 => return cell.neighbours[k],
                Some(k) => now = cell.neighbours[k],
            }
        }
        now
    }

    /// Where the probes are \[m\], each once.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// What they span.
    pub fn kind(&self) -> NetKind {
        self.kind
    }

    /// Tetrahedra, positively oriented; only in space.
    pub fn cells(&self) -> &[NetCell] {
        &self.cells
    }

    /// Faces of the hull; or both sides of the triangles of a plane, in turn.
    pub fn faces(&self) -> &[NetFace] {
        &self.faces
    }

    /// Points that were left out, because others are at the same place.
    pub fn n_duplicates(&self) -> usize {
        self.n_duplicates
    }

    /// Uploads the net for `fields::probe_net`.
    ///
    /// # Errors
    /// A buffer is larger than the device can bind.
    pub fn upload(&self, gpu: &Gpu) -> Result<NetBuffers, GpuError> {
        let copied = wgpu::BufferUsages::COPY_DST;
        let reach = self.reach();
        let points = self.points.iter().zip(&reach).map(|(p, reach)| p.extend(*reach).to_array());
        let mut data: Vec<[u32; 4]> = points.map(|of| of.map(f32::to_bits)).collect();
        let first_cell = data.len() as u32;
        data.extend(self.cells.iter().flat_map(|cell| [cell.vertices, cell.neighbours]));
        let first_face = data.len() as u32;
        data.extend(self.faces.iter().flat_map(|face| {
            let ([a, b, c], [x, y, z]) = (face.vertices, face.neighbours);
            [[a, b, c, face.cell], [x, y, z, face.reserved]]
        }));
        let first_start = data.len() as u32;
        data.extend(self.starts.chunks(4).map(|four| {
            let mut all = [OUTSIDE; 4];
            all[..four.len()].copy_from_slice(four);
            all
        }));
        let info = wgsl::ProbeNet {
            start_origin: self.start_origin,
            kind: match self.kind {
                NetKind::Empty => wgsl::NET_EMPTY,
                NetKind::Point | NetKind::Line => wgsl::NET_LINE,
                NetKind::Plane => wgsl::NET_PLANE,
                NetKind::Space => wgsl::NET_PLANE + 1,
            },
            start_size: self.start_size,
            n_points: self.points.len() as u32,
            start_cell: self.start_cell,
            unit: self.unit(),
            first_cell,
            first_face,
            first_start,
            reserved: 0,
        };
        let usage = wgpu::BufferUsages::UNIFORM | copied;
        let uniform = buffer(gpu, "net of probes", size_of::<wgsl::ProbeNet>() as u64, usage);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&info));
        let bytes: &[u8] = bytemuck::cast_slice(&data);
        let of_net = storage_buffer(gpu, "net of probes", bytes.len() as u64, copied, ADVICE)?;
        gpu.queue.write_buffer(&of_net, 0, bytes);
        Ok(NetBuffers { uniform, data: of_net })
    }

    /// The edges of its cells, or faces, or line: pairs of points, the lower index first, in order.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut all: Vec<[u32; 2]> = Vec::new();
        let mut add = |of: &[u32]| {
            for (ix, &a) in of.iter().enumerate() {
                all.extend(of[ix + 1..].iter().map(|&b| [a.min(b), a.max(b)]));
            }
        };
        self.cells.iter().for_each(|cell| add(&cell.vertices));
        self.faces.iter().for_each(|face| add(&face.vertices));
        if self.kind == NetKind::Line {
            (1..self.points.len() as u32).for_each(|ix| add(&[ix - 1, ix]));
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    fn length(&self, [a, b]: [u32; 2]) -> f64 {
        self.points[a as usize].as_dvec3().distance(self.points[b as usize].as_dvec3())
    }

    /// How far its points are from the nearest ones along edges, in the mean \[m\]: the unit of probes' distances; 1 without edges.
    pub fn unit(&self) -> f32 {
        let mut shortest = vec![f64::INFINITY; self.points.len()];
        for edge in self.edges() {
            let length = self.length(edge);
            for end in edge {
                shortest[end as usize] = length.min(shortest[end as usize]);
            }
        }
        shortest.retain(|length| length.is_finite());
        let sum: f64 = shortest.iter().sum();
        if shortest.is_empty() { 1.0 } else { (sum / shortest.len() as f64) as f32 }
    }

    /// The longest edge at each point \[m\]; 1 without edges.
    fn reach(&self) -> Vec<f32> {
        let edges = self.edges();
        let mut reach = vec![if edges.is_empty() { 1.0 } else { 0.0 }; self.points.len()];
        for edge in edges {
            let length = self.length(edge) as f32;
            for end in edge {
                reach[end as usize] = length.max(reach[end as usize]);
            }
        }
        reach
    }
}

/// The kernel `probe_net/find`: the probes that each point of a list is between.
#[derive(Debug)]
pub struct FindPass(ComputeKernel);

impl FindPass {
    /// Compiles the kernel.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ComputeKernel::new(gpu, &Shaders::default(), None, "probe_net/find"))
    }

    /// Records the look-up of `n` points. `points`: `array<vec4<f32>>` \[m\]; `found`: for each, four u32 (probes) and four f32 (their
    /// weights, whose sum is 1, or 0 if there are no probes); `counts`: two u32, at first 0: the most steps of a walk, and walks
    /// that ended before they were there.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        net: &NetBuffers,
        points: &wgpu::Buffer,
        found: &wgpu::Buffer,
        counts: &wgpu::Buffer,
        n: u32,
    ) {
        self.0
            .call(&mut recorder.compute(self.0.name()))
            .bind("points", points)
            .bind("found", found)
            .bind("counts", counts)
            .with(net.field())
            .dispatch(Dispatch::Items(n));
    }
}

/// A net on the GPU.
#[derive(Debug)]
pub struct NetBuffers {
    uniform: wgpu::Buffer,
    data: wgpu::Buffer,
}

impl NetBuffers {
    /// The bindings of kernels that look up (`fields::probe_net`).
    pub fn field(&self) -> Bindings<'_> {
        vec![("net", (&self.uniform).into()), ("net_data", (&self.data).into())]
    }
}
