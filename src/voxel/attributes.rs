//! What the voxels look like: the kernels `voxel/accumulate` and `voxel/resolve`.

use super::ADVICE;
use super::grid::{MAX_BINDING, RECORD_BYTES, VoxelError};
use super::voxelize::{Triangles, Voxelizer, uniform};
use crate::bindings::baseline::kernels::voxel::{accumulate, resolve};
use crate::bindings::baseline::lucerna::voxel::attributes::N_SUMS;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::pass::{compute_pipeline, dispatch, storage_buffer};

/// Records of the faces of a [`Voxelizer`]'s voxels.
///
/// | buffer | bytes |
/// |---|---|
/// | [`records`](Self::records) | 16 · n_faces · capacity |
/// | sums | 88 · n_faces · capacity, at most 128 MiB: then the voxels take turns in ranges of slots |
#[derive(Clone, Debug)]
pub struct VoxelAttributes {
    accumulate: wgpu::ComputePipeline,
    resolve: wgpu::ComputePipeline,
    ranges: Vec<Range>,
    records: wgpu::Buffer,
}

/// A range of slots.
#[derive(Clone, Debug)]
struct Range {
    n: u32,
    accumulate: wgpu::BindGroup,
    resolve: wgpu::BindGroup,
}

impl VoxelAttributes {
    /// Compiles the kernels and makes the buffers for the voxelizer's grid.
    ///
    /// # Errors
    /// A buffer is larger than the device binds ([`VoxelError::Gpu`]).
    pub fn new(gpu: &Gpu, scene: &GpuScene, voxelizer: &Voxelizer) -> Result<Self, VoxelError> {
        Self::with_scratch(gpu, scene, voxelizer, MAX_BINDING)
    }

    /// As [`VoxelAttributes::new`], with at most `scratch` bytes for the sums (at least those of one
    /// voxel): less memory, and more ranges that take turns.
    ///
    /// # Errors
    /// As [`VoxelAttributes::new`].
    pub fn with_scratch(
        gpu: &Gpu,
        scene: &GpuScene,
        voxelizer: &Voxelizer,
        scratch: u64,
    ) -> Result<Self, VoxelError> {
        let device = &gpu.device;
        let grid = voxelizer.grid();
        let none = wgpu::BufferUsages::empty();
        let voxel_bytes = u64::from(N_SUMS) * 8 * u64::from(grid.n_faces);
        let scratch = scratch.min(device.limits().max_storage_buffer_binding_size);
        let n_slots = (scratch / voxel_bytes).clamp(1, u64::from(grid.capacity)) as u32;
        let sums =
            storage_buffer(gpu, "voxel sums", u64::from(n_slots) * voxel_bytes, none, ADVICE)?;
        let record_bytes = RECORD_BYTES * u64::from(grid.n_faces) * u64::from(grid.capacity);
        let records = storage_buffer(gpu, "voxel records", record_bytes, none, ADVICE)?;
        let accumulate_layout = accumulate::WgpuBindGroup1::get_bind_group_layout(device);
        let resolve_layout = resolve::WgpuBindGroup1::get_bind_group_layout(device);
        let ranges = (0..grid.capacity)
            .step_by(n_slots as usize)
            .map(|first| {
                let range = accumulate::SlotRange {
                    first,
                    n: n_slots.min(grid.capacity - first),
                    brightest: scene.brightest_emission(),
                    reserved: 0,
                };
                let range_buffer = uniform(gpu, "slot range", bytemuck::bytes_of(&range));
                let entries = accumulate::WgpuBindGroup1Entries::new(
                    accumulate::WgpuBindGroup1EntriesParams {
                        grid: voxelizer.grid_buffer().as_entire_buffer_binding(),
                        work: voxelizer.work.first.as_entire_buffer_binding(),
                        range: range_buffer.as_entire_buffer_binding(),
                        structure: voxelizer.structure().as_entire_buffer_binding(),
                        sums: sums.as_entire_buffer_binding(),
                    },
                );
                let accumulate = device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel/accumulate"),
                    layout: &accumulate_layout,
                    entries: &entries.into_array(),
                });
                // Both kernels have the same range.
                let entries =
                    resolve::WgpuBindGroup1Entries::new(resolve::WgpuBindGroup1EntriesParams {
                        grid: voxelizer.grid_buffer().as_entire_buffer_binding(),
                        range: range_buffer.as_entire_buffer_binding(),
                        counts: voxelizer.counts().as_entire_buffer_binding(),
                        sums: sums.as_entire_buffer_binding(),
                        records: records.as_entire_buffer_binding(),
                    });
                let resolve = device.create_bind_group(&wgpu::BindGroupDescriptor {
                    label: Some("voxel/resolve"),
                    layout: &resolve_layout,
                    entries: &entries.into_array(),
                });
                Range { n: range.n, accumulate, resolve }
            })
            .collect();
        let seam = Some(scene.layout());
        // Without textures the kernel is smaller; ray queries it does not ask.
        let variant = if scene.variant() == "untextured" { "untextured" } else { "" };
        Ok(Self {
            accumulate: compute_pipeline(
                gpu,
                "voxel/accumulate",
                variant,
                &[seam, Some(&accumulate_layout)],
            ),
            resolve: compute_pipeline(gpu, "voxel/resolve", "", &[None, Some(&resolve_layout)]),
            ranges,
            records,
        })
    }

    /// Records making the records of all voxels from all triangles. `voxelizer`: the one of
    /// [`VoxelAttributes::new`], recorded before.
    ///
    /// # Errors
    /// [`VoxelError::OtherScene`]; nothing useful is recorded then.
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
        voxelizer: &Voxelizer,
        timestamps: Option<wgpu::ComputePassTimestampWrites>,
    ) -> Result<(), VoxelError> {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel attributes"),
            timestamp_writes: timestamps,
        });
        voxelizer.work.record(&mut pass, scene, Triangles::All)?;
        for range in &self.ranges {
            pass.set_pipeline(&self.accumulate);
            pass.set_bind_group(0, scene.bind_group(), &[]);
            pass.set_bind_group(1, &range.accumulate, &[]);
            pass.dispatch_workgroups_indirect(&voxelizer.work.indirect, 0);
            pass.set_pipeline(&self.resolve);
            pass.set_bind_group(1, &range.resolve, &[]);
            dispatch(&mut pass, range.n, resolve::WORKGROUP);
        }
        Ok(())
    }

    /// A record of 16 bytes for each face of each voxel, at slot · n_faces + face; layout in
    /// `wgsl/voxel/attributes.wgsl`. Those past [`VoxelCounts::n_records`](super::VoxelCounts) are
    /// not defined.
    pub fn records(&self) -> &wgpu::Buffer {
        &self.records
    }
}
