// SPDX-License-Identifier: MIT OR Apache-2.0
//! A picture of surfaces that a test makes up: kernels that ask `scene::pixel` get them from a buffer instead of a
//! G-buffer.

use crate::harness::{Random, gpu, read, storage};
use bytemuck::{Pod, Zeroable};
use glam::{UVec2, Vec2, Vec3, Vec4};
use lucerna::frame::{FrameView, ShaderCamera};
use lucerna::gpu::{Bindings, Resource};
use lucerna::settings;
use lucerna::shader::Source;

/// What a pixel sees. (All zero: the sky.)
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct PixelRecord {
    pub position: Vec3,
    pub depth: f32,
    pub geometric_normal: Vec3,
    pub roughness: f32,
    pub shading_normal: Vec3,
    pub metallic: f32,
    pub albedo: Vec3,
    pub is_surface: u32,
    pub base_color: Vec3,
    pub lambert: u32,
    pub emission: Vec3,
    pub position_error: f32,
    pub to_viewer: Vec3,
    pub reserved: u32,
}

const PIXEL: &str = "
#define_import_path lucerna::scene::pixel
#import lucerna::frame::gbuffer::GBufferSurface
#import lucerna::frame::view::FrameView
struct PixelRecord {
    position: vec3<f32>, depth: f32,
    geometric_normal: vec3<f32>, roughness: f32,
    shading_normal: vec3<f32>, metallic: f32,
    albedo: vec3<f32>, is_surface: u32,
    base_color: vec3<f32>, lambert: u32,
    emission: vec3<f32>, position_error: f32,
    to_viewer: vec3<f32>, reserved: u32,
}
@group(2) @binding(0) var<uniform> view: FrameView;
@group(2) @binding(1) var<storage, read> pixel_records: array<PixelRecord>;
fn pixel_surface(pixel: vec2<u32>) -> GBufferSurface {
    let found = pixel_records[pixel.y * view.size.x + pixel.x];
    var out: GBufferSurface;
    out.is_surface = found.is_surface != 0u;
    out.lambert = found.lambert != 0u;
    out.position = found.position;
    out.depth = found.depth;
    out.position_error = vec3<f32>(found.position_error);
    out.metallic = found.metallic;
    out.geometric_normal = found.geometric_normal;
    out.roughness = found.roughness;
    out.shading_normal = found.shading_normal;
    out.albedo = found.albedo;
    out.base_color = found.base_color;
    out.emission = found.emission;
    out.to_viewer = found.to_viewer;
    return out;
}
fn pixel_distance(pixel: vec2<u32>) -> f32 {
    return pixel_records[pixel.y * view.size.x + pixel.x].depth;
}
";

/// The module that replaces `lucerna::scene::pixel`.
pub fn pixel_module() -> Source {
    Source {
        import_path: "lucerna::scene::pixel".into(),
        file: "test.wgsl".into(),
        text: PIXEL.into(),
    }
}

pub struct Picture {
    pub view: FrameView,
    pub records: Vec<PixelRecord>,
    buffer: wgpu::Buffer,
}

impl Picture {
    /// `of`: what each pixel sees.
    pub fn new(size: UVec2, mut of: impl FnMut(UVec2) -> PixelRecord) -> Self {
        let view =
            settings!(FrameView { size, near: 0.01, emission_scale: 1.0, ..Zeroable::zeroed() });
        let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| UVec2::new(x, y)));
        let records: Vec<_> = pixels.map(&mut of).collect();
        let buffer = storage(bytemuck::cast_slice(&records));
        Self { view, records, buffer }
    }

    /// Takes over what was changed in `records`.
    pub fn upload(&mut self) {
        self.buffer = storage(bytemuck::cast_slice(&self.records));
    }

    pub fn size(&self) -> UVec2 {
        self.view.size
    }

    /// The bindings of group 2.
    pub fn bindings(&self) -> Bindings<'_> {
        vec![
            ("view", Resource::Uniform(bytemuck::bytes_of(&self.view))),
            ("pixel_records", (&self.buffer).into()),
        ]
    }
}

/// A camera at the origin that looks along −Z, with square pixels; `half`: tan of half the vertical angle of view.
pub fn camera(size: UVec2, half: f32) -> ShaderCamera {
    settings!(ShaderCamera {
        forward: Vec3::NEG_Z,
        right: Vec3::X * (half * size.x as f32 / size.y as f32),
        up: Vec3::Y * half,
        ..Zeroable::zeroed()
    })
}

/// Where in the picture a pixel's middle is, from −1 to 1, right and up.
pub fn on_plane(size: UVec2, pixel: UVec2) -> Vec2 {
    let at = (pixel.as_vec2() + 0.5) / size.as_vec2();
    Vec2::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y)
}

/// Random colours in [0, 1].
pub fn color(random: &mut Random) -> Vec3 {
    Vec3::new(random.unit(), random.unit(), random.unit())
}

/// A direction within the hemisphere around another one.
pub fn above(random: &mut Random, normal: Vec3) -> Vec3 {
    let direction = random.direction();
    if direction.dot(normal) < 0.0 { -direction } else { direction }
}

/// A surface with everything different, towards a viewer.
pub fn random_surface(random: &mut Random) -> PixelRecord {
    let geometric_normal = random.direction();
    let lean = geometric_normal + 0.4 * random.direction();
    let shading_normal = lean.as_dvec3().normalize().as_vec3();
    let to_viewer = loop {
        let found = above(random, geometric_normal);
        if found.dot(shading_normal).min(found.dot(geometric_normal)) > 0.05 {
            break found;
        }
    };
    PixelRecord {
        position: Vec3::new(
            random.range(-2.0, 2.0),
            random.range(-2.0, 2.0),
            random.range(-2.0, 2.0),
        ),
        depth: random.range(0.5, 9.0),
        geometric_normal,
        roughness: random.range(0.1, 1.0),
        shading_normal,
        metallic: random.unit(),
        albedo: color(random),
        is_surface: 1,
        base_color: color(random),
        lambert: 0,
        emission: color(random),
        position_error: 1e-6,
        to_viewer,
        reserved: 0,
    }
}

/// What the texels of a target hold before a run.
pub const POISON: f32 = -7.25;

/// A texture of 32-bit floats that kernels read and write, filled.
pub fn texture(size: UVec2, texels: &[Vec4]) -> wgpu::TextureView {
    assert_eq!(texels.len(), size.element_product() as usize);
    made(size, wgpu::TextureFormat::Rgba32Float, bytemuck::cast_slice(texels))
}

/// A target that holds poison.
pub fn target(size: UVec2) -> wgpu::TextureView {
    texture(size, &vec![Vec4::splat(POISON); size.element_product() as usize])
}

/// A texture of 8-bit numbers that kernels read and write, filled.
pub fn texture_of_bytes(size: UVec2, texels: &[[u8; 4]]) -> wgpu::TextureView {
    made(size, wgpu::TextureFormat::Rgba8Unorm, texels.as_flattened())
}

fn made(size: UVec2, format: wgpu::TextureFormat, bytes: &[u8]) -> wgpu::TextureView {
    let extent = wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let texture = gpu().device.create_texture(&wgpu::TextureDescriptor {
        label: Some("test"),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::STORAGE_BINDING
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let row = bytes.len() as u32 / size.y;
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(row),
        rows_per_image: Some(size.y),
    };
    gpu().queue.write_texture(texture.as_image_copy(), bytes, layout, extent);
    texture.create_view(&Default::default())
}

/// The bytes of a texture, row by row. `bytes`: those of a texel.
fn bytes_of(view: &wgpu::TextureView, bytes: u32) -> Vec<u8> {
    let texture = view.texture();
    let size = texture.size();
    let row = (bytes * size.width) as usize;
    let stride = row.next_multiple_of(256);
    let buffer = gpu().device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("test"),
        size: (stride * size.height as usize) as u64,
        usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu().device.create_command_encoder(&Default::default());
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(stride as u32),
        rows_per_image: None,
    };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        size,
    );
    gpu().queue.submit([encoder.finish()]);
    read(&buffer).chunks_exact(stride).flat_map(|of| of[..row].to_vec()).collect()
}

/// The texels of a texture of 32-bit floats.
pub fn texels(view: &wgpu::TextureView) -> Vec<Vec4> {
    bytemuck::pod_collect_to_vec(&bytes_of(view, 16))
}

/// The texels of a texture of 8-bit numbers.
pub fn bytes(view: &wgpu::TextureView) -> Vec<[u8; 4]> {
    bytemuck::pod_collect_to_vec(&bytes_of(view, 4))
}
