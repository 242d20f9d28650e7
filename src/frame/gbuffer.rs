//! What the camera sees, rasterised: the kernel `frame/gbuffer`.

use super::{BindGroupCache, Frame};
use crate::bindings::baseline::kernels::frame::gbuffer as kernel;
use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::modules::shader_module;
use glam::UVec2;

/// Textures that hold the surface in each pixel, 28 bytes a pixel. What they hold stands in
/// `wgsl/frame/gbuffer.wgsl`, whose `decode_gbuffer` reads them.
///
/// All can be bound as textures and copied from.
#[derive(Clone, Debug)]
pub struct GBuffer {
    /// Base colour, metallic.
    pub albedo: wgpu::TextureView,
    /// Shading and geometric normal, packed.
    pub normals: wgpu::TextureView,
    /// Emitted radiance, roughness.
    pub emission: wgpu::TextureView,
    /// Picture coordinates in the frame before, less those now.
    pub motion: wgpu::TextureView,
    /// near/z; 0: no surface.
    pub depth: wgpu::TextureView,
    size: UVec2,
}

impl GBuffer {
    /// rgb: base colour; a: metallic.
    pub const ALBEDO: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
    /// Packed normals.
    pub const NORMALS: wgpu::TextureFormat = wgpu::TextureFormat::Rg32Uint;
    /// rgb: radiance; a: roughness.
    pub const EMISSION: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
    /// xy: motion.
    pub const MOTION: wgpu::TextureFormat = wgpu::TextureFormat::Rg16Float;
    /// near/z.
    pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// Makes textures of this size \[pixels\], at least 1×1.
    ///
    /// # Errors
    /// [`GpuError::PictureTooLarge`]: the device holds no texture of this size.
    pub fn new(gpu: &Gpu, size: UVec2) -> Result<Self, GpuError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if size.max_element() > limit {
            return Err(GpuError::PictureTooLarge { width: size.x, height: size.y, limit });
        }
        let view = |label, format| {
            let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: extent(size),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING
                    | wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::COPY_SRC,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        Ok(Self {
            albedo: view("albedo", Self::ALBEDO),
            normals: view("normals", Self::NORMALS),
            emission: view("emission", Self::EMISSION),
            motion: view("motion", Self::MOTION),
            depth: view("depth", Self::DEPTH),
            size,
        })
    }

    /// Width and height \[pixels\].
    pub fn size(&self) -> UVec2 {
        self.size
    }
}

/// Size of a picture's texture.
pub(super) fn extent(size: UVec2) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct GBufferPass {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    variant: &'static str,
    groups: BindGroupCache,
}

impl GBufferPass {
    /// Compiles the kernel; it serves every scene of the same
    /// [`raster_variant`](GpuScene::raster_variant).
    pub fn new(gpu: &Gpu, scene: &GpuScene) -> Self {
        let name = "frame/gbuffer";
        let device = &gpu.device;
        let module = shader_module(gpu, name, scene.raster_variant());
        let layout = kernel::WgpuBindGroup1::get_bind_group_layout(device);
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &[Some(scene.raster_layout()), Some(&layout)],
            immediate_size: 0,
        });
        let target = |format| {
            Some(wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL })
        };
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(name),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some(kernel::ENTRY_CORNER),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState { cull_mode: None, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: GBuffer::DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some(kernel::ENTRY_SURFACE),
                compilation_options: Default::default(),
                targets: &[
                    target(GBuffer::ALBEDO),
                    target(GBuffer::NORMALS),
                    target(GBuffer::EMISSION),
                    target(GBuffer::MOTION),
                ],
            }),
            multiview_mask: None,
            cache: None,
        });
        Self { pipeline, layout, variant: scene.raster_variant(), groups: Default::default() }
    }

    /// Records one render pass that clears and fills the G-buffer.
    ///
    /// # Panics
    /// If the view's size is another than the G-buffer's, or the scene's variant is another than the
    /// one that the kernel was compiled for.
    pub fn record(&mut self, frame: &mut Frame, gbuffer: &GBuffer) {
        let scene = frame.scene;
        assert_eq!(self.variant, scene.raster_variant(), "compiled for another variant");
        assert_eq!(frame.view.size(), gbuffer.size, "view and G-buffer differ in size");
        let uniform = frame.view.uniform();
        let group = self.groups.get(&[uniform], &[], || {
            let entries = kernel::WgpuBindGroup1Entries::new(kernel::WgpuBindGroup1EntriesParams {
                view: uniform.as_entire_buffer_binding(),
            });
            frame.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame/gbuffer"),
                layout: &self.layout,
                entries: &entries.into_array(),
            })
        });
        let cleared = |view| {
            Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })
        };
        let mut pass = frame.encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("frame/gbuffer"),
            color_attachments: &[
                cleared(&gbuffer.albedo),
                cleared(&gbuffer.normals),
                cleared(&gbuffer.emission),
                cleared(&gbuffer.motion),
            ],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &gbuffer.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(0.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: frame.timers.as_deref_mut().and_then(|t| t.render("frame/gbuffer")),
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, scene.raster_bind_group(), &[]);
        pass.set_bind_group(1, &group, &[]);
        pass.draw(0..3 * scene.n_triangles(), 0..1);
    }
}
