// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which cells surfaces meet: the kernels `voxels/count_work`, `work_groups` and `mark`.

use super::ADVICE;
use super::grid::{VoxelError, VoxelGrid, n_bricks};
use super::occupancy::Occupancy;
use super::scan::{Scan, ScanPlan};
use crate::bindings::kernels::voxels::count_work;
use crate::gpu::{
    ComputeCall, ComputeKernel, ComputeRecorder, Dispatch, Gpu, GpuError, Recorder, Shaders,
    storage_buffer,
};
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::UVec3;

pub use crate::bindings::lucerna::components::voxels::counts::VoxelCounts;

/// Byte offset in [`Voxelizer::counts`] of the dispatch with one invocation per voxel.
pub const VOXEL_GROUPS_OFFSET: u64 = std::mem::offset_of!(VoxelCounts, voxel_groups) as u64;
/// Byte offset in [`Voxelizer::counts`] of the dispatch with one invocation per record.
pub const RECORD_GROUPS_OFFSET: u64 = std::mem::offset_of!(VoxelCounts, record_groups) as u64;

#[cfg(any(feature = "bake", feature = "nets"))]
impl VoxelCounts {
    /// Those of `n_voxels` that are known.
    pub(crate) fn known(n_voxels: u32, n_faces: u32) -> Self {
        use crate::bindings::lucerna::{
            components::voxels::counts::COUNTED_WORKGROUP, math::dispatch::DISPATCH_ROW,
        };
        let groups = |n_items: u32| {
            let n = n_items.div_ceil(COUNTED_WORKGROUP);
            UVec3::new(n.min(DISPATCH_ROW), n.div_ceil(DISPATCH_ROW), 1)
        };
        Self {
            n_voxels,
            n_records: n_voxels * n_faces,
            voxel_groups: groups(n_voxels),
            record_groups: groups(n_voxels * n_faces),
            ..bytemuck::Zeroable::zeroed()
        }
    }
}

/// Which triangles are voxelized. Afterwards the grid holds these and the triangles of the other kind that were
/// voxelized before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triangles {
    /// All triangles, moving or not; former voxels are dropped.
    All,
    /// Triangles that do not move; the voxels of moving ones are kept.
    Static,
    /// Triangles that move; the voxels of the others are kept. The choice for each frame.
    Moving,
}

impl From<Triangles> for count_work::TriangleSet {
    fn from(triangles: Triangles) -> Self {
        let which = match triangles {
            Triangles::All => count_work::SET_ALL,
            Triangles::Static => count_work::SET_STATIC,
            Triangles::Moving => count_work::SET_MOVING,
        };
        Self { which }
    }
}

/// Cuts a set of triangles into pieces of work.
#[derive(Debug)]
pub(super) struct Work {
    count: ComputeKernel,
    groups: ComputeKernel,
    scan: Scan,
    plan: ScanPlan,
    first: wgpu::Buffer,
    indirect: wgpu::Buffer,
    n_triangles: u32,
    shaders: Shaders,
}

impl Work {
    fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Result<Self, GpuError> {
        let n_triangles = scene.facts().n_triangles;
        let n = n_triangles + 1;
        let none = wgpu::BufferUsages::empty();
        let first = storage_buffer(gpu, "voxelizer's work", u64::from(n) * 4, none, ADVICE)?;
        let indirect =
            storage_buffer(gpu, "voxelizer's dispatch", 16, wgpu::BufferUsages::INDIRECT, ADVICE)?;
        let scan = Scan::new(gpu);
        let plan = scan.plan(gpu, &first, n)?;
        let kernel = |name| ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name);
        Ok(Self {
            count: kernel("voxels/count_work"),
            groups: kernel("voxels/work_groups"),
            scan,
            plan,
            first,
            indirect,
            n_triangles,
            shaders: scene.shaders().clone(),
        })
    }

    pub(super) fn check(&self, scene: &dyn SceneSeam) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        let (expected, found) = (self.n_triangles, scene.facts().n_triangles);
        if expected == found { Ok(()) } else { Err(Mismatch::Triangles { expected, found }) }
    }

    pub(super) fn record(
        &self,
        pass: &mut ComputeRecorder,
        scene: &dyn SceneSeam,
        grid: &VoxelGrid,
        triangles: Triangles,
    ) {
        let set: count_work::TriangleSet = triangles.into();
        self.count
            .call(pass)
            .scene(scene.group())
            .uniform("grid", grid)
            .uniform("part", &set)
            .bind("work", &self.first)
            .dispatch(Dispatch::Items(self.n_triangles + 1));
        self.scan.record(pass, &self.plan);
        self.groups
            .call(pass)
            .scene(scene.group())
            .bind("work", &self.first)
            .bind("groups", &self.indirect)
            .dispatch(Dispatch::Groups(UVec3::ONE));
    }

    /// Records the call of a kernel that does one piece of work per invocation.
    pub(super) fn dispatch<'c>(&'c self, call: ComputeCall<'c, '_>, scene: &'c dyn SceneSeam) {
        let pieces = Dispatch::Indirect(&self.indirect, 0);
        call.scene(scene.group()).bind("work", &self.first).dispatch(pieces);
    }
}

/// Fills a grid with the voxels of a scene.
///
/// | buffer | bytes |
/// |---|---|
/// | occupied voxels | [`Occupancy`] |
/// | bits of static and moving triangles | 2 × 4 · n_bricks |
/// | pieces of work before each triangle | 4 · n_triangles |
#[derive(Debug)]
pub struct Voxelizer {
    grid: VoxelGrid,
    pub(super) work: Work,
    mark: ComputeKernel,
    bits_static: wgpu::Buffer,
    bits_moving: wgpu::Buffer,
    occupancy: Occupancy,
}

impl Voxelizer {
    /// Compiles the kernels and creates the buffers. `grid`: from [`grid_for_bounds`](super::grid_for_bounds).
    ///
    /// # Errors
    /// A buffer is larger than the device can bind ([`VoxelError::Gpu`]).
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, grid: VoxelGrid) -> Result<Self, VoxelError> {
        let n = u64::from(n_bricks(&grid));
        let bits = |what| storage_buffer(gpu, what, n * 4, wgpu::BufferUsages::COPY_DST, ADVICE);
        Ok(Self {
            grid,
            work: Work::new(gpu, scene)?,
            mark: ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), "voxels/mark"),
            bits_static: bits("bits of static triangles")?,
            bits_moving: bits("bits of moving triangles")?,
            occupancy: Occupancy::new(gpu, &grid)?,
        })
    }

    /// Records the voxelization of `triangles`, and the structure of all voxels.
    ///
    /// # Errors
    /// [`VoxelError::Mismatch`]; nothing is recorded then.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        triangles: Triangles,
    ) -> Result<(), VoxelError> {
        self.work.check(scene)?;
        let (bits_static, bits_moving) = (&self.bits_static, &self.bits_moving);
        let bits = if triangles == Triangles::Moving { bits_moving } else { bits_static };
        if triangles == Triangles::All {
            recorder.encoder().clear_buffer(bits_moving, 0, None);
        }
        recorder.encoder().clear_buffer(bits, 0, None);
        let pass = &mut recorder.compute("voxels/voxelize");
        self.work.record(pass, scene, &self.grid, triangles);
        let mark = self.mark.call(pass).uniform("grid", &self.grid).bind("bits", bits);
        self.work.dispatch(mark, scene);
        self.occupancy.record(pass, &self.grid, bits_static, bits_moving);
        Ok(())
    }

    /// Records the call of a kernel that does one piece of work per invocation, over the triangles of the last [`record`](Self::record).
    pub(crate) fn dispatch_pieces<'c>(
        &'c self,
        call: ComputeCall<'c, '_>,
        scene: &'c dyn SceneSeam,
    ) {
        self.work.dispatch(call, scene);
    }

    /// Moves the grid to this corner \[m\], before the next [`record`](Self::record) of all triangles.
    pub fn move_to(&mut self, origin: glam::Vec3) {
        self.grid.origin = origin;
    }

    /// The grid.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// See [`Occupancy::structure`].
    pub fn structure(&self) -> &wgpu::Buffer {
        self.occupancy.structure()
    }

    /// See [`Occupancy::counts`].
    pub fn counts(&self) -> &wgpu::Buffer {
        self.occupancy.counts()
    }
}

/// Counts the triangles of each cell, for tests and for choosing a grid.
#[derive(Debug)]
pub struct TriangleCounter {
    grid: VoxelGrid,
    work: Work,
    count: ComputeKernel,
    counts: wgpu::Buffer,
}

impl TriangleCounter {
    /// Compiles the kernels and makes the buffers.
    ///
    /// # Errors
    /// A buffer is larger than the device binds.
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam, grid: VoxelGrid) -> Result<Self, VoxelError> {
        let work = Work::new(gpu, scene)?;
        let bytes = 4 * u64::from(grid.size.element_product());
        let counts =
            storage_buffer(gpu, "triangles of cells", bytes, wgpu::BufferUsages::COPY_DST, ADVICE)?;
        let name = "voxels/count_triangles";
        let count = ComputeKernel::new(gpu, scene.shaders(), Some(scene.group()), name);
        Ok(Self { grid, work, count, counts })
    }

    /// Records counting.
    ///
    /// # Errors
    /// [`VoxelError::Mismatch`]; nothing is recorded then.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        triangles: Triangles,
    ) -> Result<(), VoxelError> {
        self.work.check(scene)?;
        recorder.encoder().clear_buffer(&self.counts, 0, None);
        let pass = &mut recorder.compute(self.count.name());
        self.work.record(pass, scene, &self.grid, triangles);
        let count = self.count.call(pass).uniform("grid", &self.grid).bind("counts", &self.counts);
        self.work.dispatch(count, scene);
        Ok(())
    }

    /// One u32 per cell, x fastest.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }
}
