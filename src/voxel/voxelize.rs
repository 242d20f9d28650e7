//! Occupancy: the kernels `voxel/count_work`, `work_groups`, `mark`, `count_bricks` and
//! `write_structure`.

use super::ADVICE;
use super::grid::{VoxelError, VoxelGrid, n_bricks};
use super::scan::{Scan, ScanPlan};
use crate::bindings::baseline::kernels::voxel::{
    count_bricks, count_triangles, count_work, mark, work_groups, write_structure,
};
use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::pass::{compute_pipeline, dispatch, storage_buffer};
use wgpu::util::DeviceExt;

pub use crate::bindings::baseline::lucerna::voxel::counts::VoxelCounts;

/// Byte in [`Voxelizer::counts`] of the dispatch with an invocation a voxel.
pub const VOXEL_GROUPS_OFFSET: u64 = std::mem::offset_of!(VoxelCounts, voxel_groups) as u64;
/// Byte in [`Voxelizer::counts`] of the dispatch with an invocation a record.
pub const RECORD_GROUPS_OFFSET: u64 = std::mem::offset_of!(VoxelCounts, record_groups) as u64;

/// Which triangles are voxelized; the grid then holds them and those voxelized earlier of the other
/// kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Triangles {
    /// All, moving or not; nothing is kept.
    All,
    /// Those that do not move; the moving ones' voxels are kept.
    Static,
    /// Those that move; the others' voxels are kept. What a frame does.
    Moving,
}

/// Cuts a set of triangles into pieces of work.
#[derive(Clone, Debug)]
pub(super) struct Work {
    count: wgpu::ComputePipeline,
    groups: wgpu::ComputePipeline,
    scan: Scan,
    plan: ScanPlan,
    /// By [`Triangles`].
    count_groups: [wgpu::BindGroup; 3],
    groups_group: wgpu::BindGroup,
    pub(super) first: wgpu::Buffer,
    pub(super) indirect: wgpu::Buffer,
    n_triangles: u32,
    variant: &'static str,
}

fn set_of(triangles: Triangles) -> count_work::TriangleSet {
    let which = match triangles {
        Triangles::All => count_work::SET_ALL,
        Triangles::Static => count_work::SET_STATIC,
        Triangles::Moving => count_work::SET_MOVING,
    };
    count_work::TriangleSet { which }
}

pub(super) fn uniform(gpu: &Gpu, what: &'static str, contents: &[u8]) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(what),
        contents,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
    })
}

impl Work {
    fn new(gpu: &Gpu, scene: &GpuScene, grid: &wgpu::Buffer) -> Result<Self, GpuError> {
        let device = &gpu.device;
        let seam = Some(scene.layout());
        let n = scene.n_triangles() + 1;
        let none = wgpu::BufferUsages::empty();
        let first = storage_buffer(gpu, "voxelizer's work", u64::from(n) * 4, none, ADVICE)?;
        let indirect =
            storage_buffer(gpu, "voxelizer's dispatch", 16, wgpu::BufferUsages::INDIRECT, ADVICE)?;
        let scan = Scan::new(gpu);
        let plan = scan.plan(gpu, &first, n)?;
        let count_layout = count_work::WgpuBindGroup1::get_bind_group_layout(device);
        let groups_layout = work_groups::WgpuBindGroup1::get_bind_group_layout(device);
        let count_groups =
            [Triangles::All, Triangles::Static, Triangles::Moving].map(|triangles| {
                let part = uniform(gpu, "triangle set", bytemuck::bytes_of(&set_of(triangles)));
                let entries = count_work::WgpuBindGroup1Entries::new(
                    count_work::WgpuBindGroup1EntriesParams {
                        grid: grid.as_entire_buffer_binding(),
                        part: part.as_entire_buffer_binding(),
                        work: first.as_entire_buffer_binding(),
                    },
                );
                device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel/count_work"),
                    layout: &count_layout,
                    entries: &entries.into_array(),
                })
            });
        let entries =
            work_groups::WgpuBindGroup1Entries::new(work_groups::WgpuBindGroup1EntriesParams {
                work: first.as_entire_buffer_binding(),
                groups: indirect.as_entire_buffer_binding(),
            });
        let groups_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel/work_groups"),
            layout: &groups_layout,
            entries: &entries.into_array(),
        });
        Ok(Self {
            count: compute_pipeline(gpu, "voxel/count_work", "", &[seam, Some(&count_layout)]),
            groups: compute_pipeline(gpu, "voxel/work_groups", "", &[seam, Some(&groups_layout)]),
            scan,
            plan,
            count_groups,
            groups_group,
            first,
            indirect,
            n_triangles: scene.n_triangles(),
            variant: scene.variant(),
        })
    }

    /// Leaves the seam's bind group set.
    pub(super) fn record(
        &self,
        pass: &mut wgpu::ComputePass,
        scene: &GpuScene,
        triangles: Triangles,
    ) -> Result<(), VoxelError> {
        assert_eq!(self.variant, scene.variant(), "compiled for another variant");
        if scene.n_triangles() != self.n_triangles {
            return Err(VoxelError::OtherScene {
                expected: self.n_triangles,
                found: scene.n_triangles(),
            });
        }
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_pipeline(&self.count);
        pass.set_bind_group(1, &self.count_groups[triangles as usize], &[]);
        dispatch(pass, self.n_triangles + 1, count_work::WORKGROUP);
        self.scan.record(pass, &self.plan);
        pass.set_bind_group(0, scene.bind_group(), &[]);
        pass.set_pipeline(&self.groups);
        pass.set_bind_group(1, &self.groups_group, &[]);
        pass.dispatch_workgroups(1, 1, 1);
        Ok(())
    }
}

/// Fills a grid with the voxels of a scene.
///
/// | buffer | bytes |
/// |---|---|
/// | [`structure`](Self::structure) | 8 · (n_bricks + capacity) |
/// | [`counts`](Self::counts) | 48 |
/// | bits of static and moving triangles, slots before each brick | 3 × 4 · n_bricks |
/// | pieces of work before each triangle | 4 · n_triangles |
#[derive(Clone, Debug)]
pub struct Voxelizer {
    grid: VoxelGrid,
    grid_buffer: wgpu::Buffer,
    pub(super) work: Work,
    mark: wgpu::ComputePipeline,
    count_bricks: wgpu::ComputePipeline,
    write_structure: wgpu::ComputePipeline,
    plan: ScanPlan,
    bits: [wgpu::Buffer; 2],
    mark_groups: [wgpu::BindGroup; 2],
    bricks_group: wgpu::BindGroup,
    structure_group: wgpu::BindGroup,
    structure: wgpu::Buffer,
    counts: wgpu::Buffer,
}

impl Voxelizer {
    /// Compiles the kernels and makes the buffers. `grid`: of
    /// [`grid_for_bounds`](super::grid_for_bounds).
    ///
    /// # Errors
    /// A buffer is larger than the device binds ([`VoxelError::Gpu`]).
    pub fn new(gpu: &Gpu, scene: &GpuScene, grid: VoxelGrid) -> Result<Self, VoxelError> {
        let device = &gpu.device;
        let seam = Some(scene.layout());
        let none = wgpu::BufferUsages::empty();
        let grid_buffer = uniform(gpu, "voxel grid", bytemuck::bytes_of(&grid));
        let work = Work::new(gpu, scene, &grid_buffer)?;
        let n = u64::from(n_bricks(&grid));
        let bits = [
            storage_buffer(
                gpu,
                "bits of static triangles",
                n * 4,
                wgpu::BufferUsages::COPY_DST,
                ADVICE,
            )?,
            storage_buffer(
                gpu,
                "bits of moving triangles",
                n * 4,
                wgpu::BufferUsages::COPY_DST,
                ADVICE,
            )?,
        ];
        let before = storage_buffer(gpu, "voxels before each brick", (n + 1) * 4, none, ADVICE)?;
        let structure_bytes = 8 * (n + u64::from(grid.capacity));
        let structure = storage_buffer(gpu, "voxel structure", structure_bytes, none, ADVICE)?;
        let count_bytes = size_of::<VoxelCounts>() as u64;
        let counts =
            storage_buffer(gpu, "voxel counts", count_bytes, wgpu::BufferUsages::INDIRECT, ADVICE)?;
        let plan = work.scan.plan(gpu, &before, n_bricks(&grid) + 1)?;

        let mark_layout = mark::WgpuBindGroup1::get_bind_group_layout(device);
        let mark_groups = [0, 1].map(|set: usize| {
            let entries = mark::WgpuBindGroup1Entries::new(mark::WgpuBindGroup1EntriesParams {
                grid: grid_buffer.as_entire_buffer_binding(),
                work: work.first.as_entire_buffer_binding(),
                bits: bits[set].as_entire_buffer_binding(),
            });
            device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("voxel/mark"),
                layout: &mark_layout,
                entries: &entries.into_array(),
            })
        });
        let bricks_layout = count_bricks::WgpuBindGroup1::get_bind_group_layout(device);
        let entries =
            count_bricks::WgpuBindGroup1Entries::new(count_bricks::WgpuBindGroup1EntriesParams {
                grid: grid_buffer.as_entire_buffer_binding(),
                bits_static: bits[0].as_entire_buffer_binding(),
                bits_moving: bits[1].as_entire_buffer_binding(),
                n_voxels: before.as_entire_buffer_binding(),
            });
        let bricks_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel/count_bricks"),
            layout: &bricks_layout,
            entries: &entries.into_array(),
        });
        let structure_layout = write_structure::WgpuBindGroup1::get_bind_group_layout(device);
        let entries = write_structure::WgpuBindGroup1Entries::new(
            write_structure::WgpuBindGroup1EntriesParams {
                grid: grid_buffer.as_entire_buffer_binding(),
                bits_static: bits[0].as_entire_buffer_binding(),
                bits_moving: bits[1].as_entire_buffer_binding(),
                n_before: before.as_entire_buffer_binding(),
                structure: structure.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
            },
        );
        let structure_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel/write_structure"),
            layout: &structure_layout,
            entries: &entries.into_array(),
        });
        Ok(Self {
            grid,
            grid_buffer,
            mark: compute_pipeline(gpu, "voxel/mark", "", &[seam, Some(&mark_layout)]),
            count_bricks: compute_pipeline(
                gpu,
                "voxel/count_bricks",
                "",
                &[None, Some(&bricks_layout)],
            ),
            write_structure: compute_pipeline(
                gpu,
                "voxel/write_structure",
                "",
                &[None, Some(&structure_layout)],
            ),
            work,
            plan,
            bits,
            mark_groups,
            bricks_group,
            structure_group,
            structure,
            counts,
        })
    }

    /// Records voxelizing `triangles` and the structure of all voxels.
    ///
    /// # Errors
    /// [`VoxelError::OtherScene`]; nothing useful is recorded then.
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernels were compiled for.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        triangles: Triangles,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) -> Result<(), VoxelError> {
        let set = match triangles {
            Triangles::All => {
                encoder.clear_buffer(&self.bits[1], 0, None);
                0
            }
            Triangles::Static => 0,
            Triangles::Moving => 1,
        };
        encoder.clear_buffer(&self.bits[set], 0, None);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxelize"),
            timestamp_writes: timestamps,
        });
        self.work.record(&mut pass, scene, triangles)?;
        pass.set_pipeline(&self.mark);
        pass.set_bind_group(1, &self.mark_groups[set], &[]);
        pass.dispatch_workgroups_indirect(&self.work.indirect, 0);
        let n = n_bricks(&self.grid) + 1;
        pass.set_pipeline(&self.count_bricks);
        pass.set_bind_group(1, &self.bricks_group, &[]);
        dispatch(&mut pass, n, count_bricks::WORKGROUP);
        self.work.scan.record(&mut pass, &self.plan);
        pass.set_pipeline(&self.write_structure);
        pass.set_bind_group(1, &self.structure_group, &[]);
        dispatch(&mut pass, n, write_structure::WORKGROUP);
        Ok(())
    }

    /// Puts the grid somewhere else \[m\], before the next [`record`](Self::record) of all triangles.
    pub fn move_to(&mut self, gpu: &Gpu, origin: glam::Vec3) {
        self.grid.origin = origin;
        gpu.queue.write_buffer(&self.grid_buffer, 0, bytemuck::bytes_of(&self.grid));
    }

    /// The grid.
    pub fn grid(&self) -> &VoxelGrid {
        &self.grid
    }

    /// The grid as a uniform buffer.
    pub fn grid_buffer(&self) -> &wgpu::Buffer {
        &self.grid_buffer
    }

    /// `array<vec2<u32>>`: for each brick its occupied bits and first slot, then `capacity` entries
    /// (packed cell, 0), of which the first `n_voxels` are valid. See `wgsl/voxel/bricks.wgsl`.
    pub fn structure(&self) -> &wgpu::Buffer {
        &self.structure
    }

    /// One [`VoxelCounts`], also for indirect dispatches: see [`VOXEL_GROUPS_OFFSET`] and
    /// [`RECORD_GROUPS_OFFSET`].
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }
}

/// Counts the triangles of each cell; for tests and for choosing a grid.
#[derive(Clone, Debug)]
pub struct TriangleCounter {
    work: Work,
    pipeline: wgpu::ComputePipeline,
    bind_group: wgpu::BindGroup,
    counts: wgpu::Buffer,
}

impl TriangleCounter {
    /// Compiles the kernels and makes the buffers.
    ///
    /// # Errors
    /// A buffer is larger than the device binds.
    pub fn new(gpu: &Gpu, scene: &GpuScene, grid: VoxelGrid) -> Result<Self, VoxelError> {
        let grid_buffer = uniform(gpu, "voxel grid", bytemuck::bytes_of(&grid));
        let work = Work::new(gpu, scene, &grid_buffer)?;
        let bytes = 4 * u64::from(grid.size.element_product());
        let counts =
            storage_buffer(gpu, "triangles of cells", bytes, wgpu::BufferUsages::COPY_DST, ADVICE)?;
        let layout = count_triangles::WgpuBindGroup1::get_bind_group_layout(&gpu.device);
        let entries = count_triangles::WgpuBindGroup1Entries::new(
            count_triangles::WgpuBindGroup1EntriesParams {
                grid: grid_buffer.as_entire_buffer_binding(),
                work: work.first.as_entire_buffer_binding(),
                counts: counts.as_entire_buffer_binding(),
            },
        );
        let bind_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("voxel/count_triangles"),
            layout: &layout,
            entries: &entries.into_array(),
        });
        let pipeline = compute_pipeline(
            gpu,
            "voxel/count_triangles",
            "",
            &[Some(scene.layout()), Some(&layout)],
        );
        Ok(Self { work, pipeline, bind_group, counts })
    }

    /// Records counting.
    ///
    /// # Errors
    /// [`VoxelError::OtherScene`].
    ///
    /// # Panics
    /// If the scene's variant is another than the one that the kernels were compiled for.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        triangles: Triangles,
    ) -> Result<(), VoxelError> {
        encoder.clear_buffer(&self.counts, 0, None);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        self.work.record(&mut pass, scene, triangles)?;
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &self.bind_group, &[]);
        pass.dispatch_workgroups_indirect(&self.work.indirect, 0);
        Ok(())
    }

    /// One u32 a cell, x fastest.
    pub fn counts(&self) -> &wgpu::Buffer {
        &self.counts
    }
}
