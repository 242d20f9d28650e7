// SPDX-License-Identifier: MIT OR Apache-2.0
//! A renderer that does not use lucerna: a device, a mesh, camera matrices, and a pass that draws three targets.

use bytemuck::{Pod, Zeroable};
use glam::camera::rh::{proj, view};
use glam::{Mat4, UVec2, Vec3};
use wgpu::util::DeviceExt;

/// A corner of a triangle.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Vertex {
    pub position: [f32; 3],
    normal: [f32; 3],
    pub color: [f32; 3],
}

/// The G-buffer.
pub struct Targets {
    pub size: UVec2,
    pub albedo: wgpu::TextureView,
    /// Scaled and shifted into [0, 1].
    pub normal: wgpu::TextureView,
    /// Along the view axis [m]; 0: nothing.
    pub distance: wgpu::TextureView,
    depth: wgpu::TextureView,
}

pub struct Renderer {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub vertices: Vec<Vertex>,
    pub triangles: Vec<[u32; 3]>,
    /// Position [m] and intensity [W·sr⁻¹].
    pub lamp: (Vec3, Vec3),
    pub world_from_view: Mat4,
    pub vertical_fov: f32,
    pub targets: Targets,
    pipeline: wgpu::RenderPipeline,
    camera: wgpu::BindGroup,
    vertex_buffer: wgpu::Buffer,
    index_buffer: wgpu::Buffer,
}

const FORMATS: [wgpu::TextureFormat; 3] = [
    wgpu::TextureFormat::Rgba8UnormSrgb,
    wgpu::TextureFormat::Rgba16Float,
    wgpu::TextureFormat::R32Float,
];
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A room 4 m wide, open at the front, with a block in it.
fn room() -> (Vec<Vertex>, Vec<[u32; 3]>) {
    let (white, red, green) = ([0.7, 0.7, 0.7], [0.6, 0.1, 0.1], [0.1, 0.5, 0.1]);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    let room = Vec3::new(-2.0, 0.0, -2.0);
    let block = Vec3::new(-0.9, 0.0, -0.8);
    // Corner, two sides whose cross product points to the front, colour.
    let quads = [
        (room, 4.0 * z, 4.0 * x, white),
        (room + 4.0 * y, 4.0 * x, 4.0 * z, white),
        (room, 4.0 * x, 4.0 * y, white),
        (room, 4.0 * y, 4.0 * z, red),
        (room + 4.0 * x, 4.0 * z, 4.0 * y, green),
        (block + 1.8 * y, 1.2 * z, 1.2 * x, white),
        (block + 1.2 * z, 1.2 * x, 1.8 * y, white),
        (block, 1.8 * y, 1.2 * x, white),
        (block, 1.2 * z, 1.8 * y, white),
        (block + 1.2 * x, 1.8 * y, 1.2 * z, white),
    ];
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for (corner, u, v, color) in quads {
        let first = vertices.len() as u32;
        let normal = u.cross(v).normalize().to_array();
        for position in [corner, corner + u, corner + u + v, corner + v] {
            vertices.push(Vertex { position: position.to_array(), normal, color });
        }
        triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    (vertices, triangles)
}

impl Renderer {
    pub fn new(size: UVec2) -> Result<Self, Box<dyn std::error::Error>> {
        let instance =
            wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;

        let (vertices, triangles) = room();
        let buffer = |contents: &[u8], usage| {
            let descriptor = wgpu::util::BufferInitDescriptor { label: None, contents, usage };
            device.create_buffer_init(&descriptor)
        };
        let vertex_buffer = buffer(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX);
        let index_buffer = buffer(bytemuck::cast_slice(&triangles), wgpu::BufferUsages::INDEX);

        let vertical_fov = 42f32.to_radians();
        let (eye, target) = (Vec3::new(0.6, 2.4, 7.2), Vec3::new(0.0, 1.9, 0.0));
        let view_from_world = view::look_at_mat4(eye, target, Vec3::Y);
        let aspect = size.x as f32 / size.y as f32;
        let clip_from_view = proj::directx::perspective(vertical_fov, aspect, 0.1, 50.0);
        let matrices = [clip_from_view * view_from_world, view_from_world];
        let camera_buffer = buffer(bytemuck::cast_slice(&matrices), wgpu::BufferUsages::UNIFORM);

        let module = device.create_shader_module(wgpu::include_wgsl!("raster.wgsl"));
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x3];
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Vertex>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &attributes,
                })],
            },
            primitive: Default::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Less),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &FORMATS.map(|format| Some(format.into())),
            }),
            multiview_mask: None,
            cache: None,
        });
        let camera = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[wgpu::BindGroupEntry {
                binding: 0,
                resource: camera_buffer.as_entire_binding(),
            }],
        });
        let target = |format| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT
                    | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            });
            texture.create_view(&Default::default())
        };
        let [albedo, normal, distance] = FORMATS.map(target);
        let targets = Targets { size, albedo, normal, distance, depth: target(DEPTH) };
        Ok(Self {
            vertices,
            triangles,
            lamp: (Vec3::new(0.4, 3.3, 0.6), Vec3::splat(12.0)),
            world_from_view: view_from_world.inverse(),
            vertical_fov,
            targets,
            pipeline,
            camera,
            vertex_buffer,
            index_buffer,
            device,
            queue,
        })
    }

    /// Draws the G-buffer.
    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let Targets { albedo, normal, distance, depth, .. } = &self.targets;
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
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("renderer's own G-buffer"),
            color_attachments: &[cleared(albedo), cleared(normal), cleared(distance)],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.camera, &[]);
        pass.set_vertex_buffer(0, self.vertex_buffer.slice(..));
        pass.set_index_buffer(self.index_buffer.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..3 * self.triangles.len() as u32, 0, 0..1);
    }
}
