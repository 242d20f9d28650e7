// SPDX-License-Identifier: MIT OR Apache-2.0
//! Voxelization by the rasteriser, as the source of `voxel-rt` does and proposes, for comparison
//! with [`Voxelizer`](super::Voxelizer), which is exact.

use super::ADVICE;
use super::grid::{VoxelError, VoxelGrid, n_bricks};
use crate::bindings::kernels::voxels::{raster_quad_vertex, raster_vertex};
use crate::bindings::lucerna::components::voxels::raster::AXIS_DOMINANT;
use crate::gpu::{
    ComputeKernel, Dispatch, Gpu, Recorder, RenderKernel, RenderState, Resource, extent,
    storage_buffer,
};
use crate::seam::{Mismatch, SceneSeam};
use glam::UVec2;

/// How the rasteriser is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RasterMethod {
    /// Three pictures, one along each axis; a fragment marks the cell of its centre.
    ThreeAxes,
    /// One picture, each triangle along its dominant axis; a fragment marks the cell of its centre.
    DominantAxis,
    /// One picture, a rectangle around each triangle; a fragment tests the cells of its column.
    BoundingQuad,
}

/// Bytes of a triangle in a grid: three corners of 16 bytes each.
const CORNER_BYTES: u64 = 48;
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Marks a scene's cells with the rasteriser.
#[derive(Debug)]
pub struct RasterVoxelizer {
    grid: VoxelGrid,
    method: RasterMethod,
    corners_kernel: ComputeKernel,
    draw: RenderKernel,
    corners: wgpu::Buffer,
    bits: wgpu::Buffer,
    target: wgpu::TextureView,
    n_triangles: u32,
}

impl RasterVoxelizer {
    /// Compiles the kernels and creates the buffers.
    ///
    /// # Errors
    /// A buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        grid: VoxelGrid,
        method: RasterMethod,
    ) -> Result<Self, VoxelError> {
        let none = wgpu::BufferUsages::empty();
        let n_triangles = scene.facts().n_triangles;
        let corner_bytes = CORNER_BYTES * u64::from(n_triangles.max(1));
        let bit_bytes = 4 * u64::from(n_bricks(&grid));
        let (vertex, fragment) = match method {
            RasterMethod::BoundingQuad => {
                ("voxels/raster_quad_vertex", "voxels/raster_quad_fragment")
            }
            _ => ("voxels/raster_vertex", "voxels/raster_fragment"),
        };
        let state = RenderState { targets: &[TARGET], ..Default::default() };
        // A render pass needs a target, although nothing is drawn into it.
        let target = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("raster voxelizer"),
            size: extent(UVec2::splat(grid.size.max_element())),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TARGET,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let (shaders, group) = (scene.shaders(), Some(scene.group()));
        let usage = wgpu::BufferUsages::COPY_DST;
        Ok(Self {
            grid,
            method,
            corners_kernel: ComputeKernel::new(gpu, shaders, group, "voxels/raster_corners"),
            draw: RenderKernel::new(gpu, shaders, group, vertex, fragment, state),
            corners: storage_buffer(gpu, "triangles in cells", corner_bytes, none, ADVICE)?,
            bits: storage_buffer(gpu, "bits", bit_bytes, usage, ADVICE)?,
            target: target.create_view(&Default::default()),
            n_triangles,
        })
    }

    /// Records marking all triangles.
    ///
    /// # Errors
    /// [`VoxelError::Mismatch`].
    pub fn record(&self, recorder: &mut Recorder, scene: &dyn SceneSeam) -> Result<(), VoxelError> {
        let (expected, found) = (self.n_triangles, scene.facts().n_triangles);
        if found != expected {
            return Err(Mismatch::Triangles { expected, found }.into());
        }
        recorder.encoder().clear_buffer(&self.bits, 0, None);
        self.corners_kernel
            .call(&mut recorder.compute(self.corners_kernel.name()))
            .scene(scene.group())
            .uniform("grid", &self.grid)
            .bind("corners", &self.corners)
            .dispatch(Dispatch::Items(self.n_triangles));
        let axes: &[u32] = match self.method {
            RasterMethod::ThreeAxes => &[0, 1, 2],
            _ => &[AXIS_DOMINANT],
        };
        let is_quad = self.method == RasterMethod::BoundingQuad;
        let pass = &mut recorder.render("voxels/raster", &[&self.target], None);
        for &axis in axes {
            let side = self.grid.size.max_element();
            let view = raster_vertex::RasterView { side, axis };
            let of_quad = raster_quad_vertex::RasterView { side, axis };
            let view =
                if is_quad { bytemuck::bytes_of(&of_quad) } else { bytemuck::bytes_of(&view) };
            let bound = [
                ("grid", Resource::Uniform(bytemuck::bytes_of(&self.grid))),
                ("view", Resource::Uniform(view)),
                ("corners", Resource::Buffer(&self.corners)),
                ("bits", Resource::Buffer(&self.bits)),
            ];
            let per_triangle = if is_quad { 6 } else { 3 };
            self.draw.draw(pass, None, &bound, per_triangle * self.n_triangles);
        }
        Ok(())
    }

    /// One word of occupied bits per brick, see `wgsl/components/voxels/bricks.wgsl`.
    pub fn bits(&self) -> &wgpu::Buffer {
        &self.bits
    }
}
