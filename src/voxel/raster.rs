//! Voxelizing by the rasteriser, as the source of `voxel-rt` does and proposes; to compare
//! [`Voxelizer`](super::Voxelizer) with, which is exact.

use super::ADVICE;
use super::grid::{VoxelError, VoxelGrid, n_bricks};
use super::voxelize::uniform;
use crate::bindings::baseline::kernels::voxel::{
    raster_corners, raster_fragment, raster_quad_fragment, raster_quad_vertex, raster_vertex,
};
use crate::bindings::baseline::lucerna::voxel::raster::AXIS_DOMINANT;
use crate::gpu::Gpu;
use crate::gpu_scene::GpuScene;
use crate::modules::shader_module;
use crate::pass::{compute_pipeline, dispatch, storage_buffer};

/// How the rasteriser is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RasterMethod {
    /// Three pictures, one along each axis; a fragment marks the cell of its middle.
    ThreeAxes,
    /// One picture, each triangle along its dominant axis; a fragment marks the cell of its middle.
    DominantAxis,
    /// One picture, a rectangle around each triangle; a fragment tests the cells of its column.
    BoundingQuad,
}

/// Bytes of a triangle in a grid: three corners of 16.
const CORNER_BYTES: u64 = 48;
const TARGET: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// Marks a scene's cells with the rasteriser.
#[derive(Clone, Debug)]
pub struct RasterVoxelizer {
    method: RasterMethod,
    corners_pipeline: wgpu::ComputePipeline,
    corners_group: wgpu::BindGroup,
    draw: wgpu::RenderPipeline,
    /// One a picture.
    views: Vec<wgpu::BindGroup>,
    fragment_group: wgpu::BindGroup,
    bits: wgpu::Buffer,
    target: wgpu::TextureView,
    n_triangles: u32,
}

fn group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    entries: &[wgpu::BindGroupEntry],
) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("raster voxelizer"),
        layout,
        entries,
    })
}

impl RasterVoxelizer {
    /// Compiles the kernels and makes the buffers.
    ///
    /// # Errors
    /// A buffer is larger than the device binds.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        grid: VoxelGrid,
        method: RasterMethod,
    ) -> Result<Self, VoxelError> {
        let device = &gpu.device;
        let none = wgpu::BufferUsages::empty();
        let n_triangles = scene.n_triangles();
        let corner_bytes = CORNER_BYTES * u64::from(n_triangles.max(1));
        let corners = storage_buffer(gpu, "triangles in cells", corner_bytes, none, ADVICE)?;
        let bit_bytes = 4 * u64::from(n_bricks(&grid));
        let bits = storage_buffer(gpu, "bits", bit_bytes, wgpu::BufferUsages::COPY_DST, ADVICE)?;
        let grid_buffer = uniform(gpu, "voxel grid", bytemuck::bytes_of(&grid));
        let grid_entry = || grid_buffer.as_entire_buffer_binding();

        let corners_layout = raster_corners::WgpuBindGroup1::get_bind_group_layout(device);
        let entries = raster_corners::WgpuBindGroup1Entries::new(
            raster_corners::WgpuBindGroup1EntriesParams {
                grid: grid_entry(),
                corners: corners.as_entire_buffer_binding(),
            },
        );
        let corners_group = group(gpu, &corners_layout, &entries.into_array());

        let quad = method == RasterMethod::BoundingQuad;
        // The two vertex kernels have the same bindings.
        let vertex_layout = raster_vertex::WgpuBindGroup1::get_bind_group_layout(device);
        let axes: &[u32] = match method {
            RasterMethod::ThreeAxes => &[0, 1, 2],
            _ => &[AXIS_DOMINANT],
        };
        let side = grid.size.max_element();
        let views = axes
            .iter()
            .map(|&axis| {
                let view = raster_vertex::RasterView { side, axis };
                let view = uniform(gpu, "raster view", bytemuck::bytes_of(&view));
                let entries = raster_vertex::WgpuBindGroup1Entries::new(
                    raster_vertex::WgpuBindGroup1EntriesParams {
                        grid: grid_entry(),
                        view: view.as_entire_buffer_binding(),
                        corners: corners.as_entire_buffer_binding(),
                    },
                );
                group(gpu, &vertex_layout, &entries.into_array())
            })
            .collect();
        let (fragment_layout, fragment_group) = if quad {
            let layout = raster_quad_fragment::WgpuBindGroup2::get_bind_group_layout(device);
            let entries = raster_quad_fragment::WgpuBindGroup2Entries::new(
                raster_quad_fragment::WgpuBindGroup2EntriesParams {
                    grid: grid_entry(),
                    bits: bits.as_entire_buffer_binding(),
                    corners: corners.as_entire_buffer_binding(),
                },
            );
            let group = group(gpu, &layout, &entries.into_array());
            (layout, group)
        } else {
            let layout = raster_fragment::WgpuBindGroup2::get_bind_group_layout(device);
            let entries = raster_fragment::WgpuBindGroup2Entries::new(
                raster_fragment::WgpuBindGroup2EntriesParams {
                    grid: grid_entry(),
                    bits: bits.as_entire_buffer_binding(),
                },
            );
            let group = group(gpu, &layout, &entries.into_array());
            (layout, group)
        };
        let (vertex_name, vertex_entry, fragment_name, fragment_entry) = if quad {
            (
                "voxel/raster_quad_vertex",
                raster_quad_vertex::ENTRY_MAIN,
                "voxel/raster_quad_fragment",
                raster_quad_fragment::ENTRY_MAIN,
            )
        } else {
            (
                "voxel/raster_vertex",
                raster_vertex::ENTRY_MAIN,
                "voxel/raster_fragment",
                raster_fragment::ENTRY_MAIN,
            )
        };
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(vertex_name),
            bind_group_layouts: &[None, Some(&vertex_layout), Some(&fragment_layout)],
            immediate_size: 0,
        });
        let draw = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(vertex_name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &shader_module(gpu, vertex_name, ""),
                entry_point: Some(vertex_entry),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &shader_module(gpu, fragment_name, ""),
                entry_point: Some(fragment_entry),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: TARGET,
                    blend: None,
                    write_mask: wgpu::ColorWrites::empty(),
                })],
            }),
            multiview_mask: None,
            cache: None,
        });
        // A render pass has a picture, though nothing is written to it.
        let target = device
            .create_texture(&wgpu::TextureDescriptor {
                label: Some("raster voxelizer"),
                size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: TARGET,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
            .create_view(&Default::default());
        let corners_pipeline = compute_pipeline(
            gpu,
            "voxel/raster_corners",
            "",
            &[Some(scene.layout()), Some(&corners_layout)],
        );
        Ok(Self {
            method,
            corners_pipeline,
            corners_group,
            draw,
            views,
            fragment_group,
            bits,
            target,
            n_triangles,
        })
    }

    /// Records marking all triangles.
    ///
    /// # Errors
    /// [`VoxelError::OtherScene`].
    pub fn record(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        scene: &GpuScene,
    ) -> Result<(), VoxelError> {
        let found = scene.n_triangles();
        if found != self.n_triangles {
            return Err(VoxelError::OtherScene { expected: self.n_triangles, found });
        }
        encoder.clear_buffer(&self.bits, 0, None);
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&self.corners_pipeline);
            pass.set_bind_group(0, scene.bind_group(), &[]);
            pass.set_bind_group(1, &self.corners_group, &[]);
            dispatch(&mut pass, self.n_triangles, raster_corners::WORKGROUP);
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("raster voxelizer"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.target,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                    store: wgpu::StoreOp::Discard,
                },
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.draw);
        pass.set_bind_group(2, &self.fragment_group, &[]);
        let per_triangle = if self.method == RasterMethod::BoundingQuad { 6 } else { 3 };
        for view in &self.views {
            pass.set_bind_group(1, view, &[]);
            pass.draw(0..per_triangle * self.n_triangles, 0..1);
        }
        Ok(())
    }

    /// A word of occupied bits a brick, see `wgsl/voxel/bricks.wgsl`.
    pub fn bits(&self) -> &wgpu::Buffer {
        &self.bits
    }
}
