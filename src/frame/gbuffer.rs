// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the camera sees, rasterised: the kernel `frame/gbuffer`.

use super::{PixelSurfaces, View, check_size};
use crate::gpu::{
    Bindings, Gpu, GpuError, Recorder, RenderKernel, RenderState, Resource, Shaders, check_picture,
    picture_texture,
};
use crate::seam::{Mismatch, SceneSeam, check_shaders};
use glam::UVec2;

/// Textures that hold the surface in each pixel, 32 bytes per pixel. Their contents are documented in
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
    /// Picture coordinates in the previous frame, minus the current ones.
    pub motion: wgpu::TextureView,
    /// Which triangle, as `scene::triangles` counts them.
    pub triangles: wgpu::TextureView,
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
    /// Index of the triangle.
    pub const TRIANGLES: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;
    /// near/z.
    pub const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// Creates textures of this size \[pixels\], at least 1×1.
    ///
    /// # Errors
    /// [`GpuError::EmptyPicture`], or [`GpuError::PictureTooLarge`]: the device cannot create a texture of this size.
    pub fn new(gpu: &Gpu, size: UVec2) -> Result<Self, GpuError> {
        check_picture(gpu, size)?;
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
        let view = |label, format| picture_texture(gpu, label, size, format, usage);
        Ok(Self {
            albedo: view("albedo", Self::ALBEDO),
            normals: view("normals", Self::NORMALS),
            emission: view("emission", Self::EMISSION),
            motion: view("motion", Self::MOTION),
            triangles: view("triangles", Self::TRIANGLES),
            depth: view("depth", Self::DEPTH),
            size,
        })
    }

    /// Uses the caller's textures, which must have the formats [`Self::ALBEDO`] and so on, and the same size.
    ///
    /// # Errors
    /// [`GpuError::OtherFormat`] or [`GpuError::OtherSize`]: a texture's format or size does not match.
    pub fn from_views(
        albedo: wgpu::TextureView,
        normals: wgpu::TextureView,
        emission: wgpu::TextureView,
        motion: wgpu::TextureView,
        triangles: wgpu::TextureView,
        depth: wgpu::TextureView,
    ) -> Result<Self, GpuError> {
        let size = albedo.texture().size();
        for (what, view, format) in [
            ("albedo", &albedo, Self::ALBEDO),
            ("normals", &normals, Self::NORMALS),
            ("emission", &emission, Self::EMISSION),
            ("motion", &motion, Self::MOTION),
            ("triangles", &triangles, Self::TRIANGLES),
            ("depth", &depth, Self::DEPTH),
        ] {
            let texture = view.texture();
            let found = texture.format();
            if found != format {
                return Err(GpuError::OtherFormat { what, expected: format, found });
            }
            let found = texture.size();
            if found != size {
                let of = |size: wgpu::Extent3d| UVec2::new(size.width, size.height);
                return Err(GpuError::OtherSize { what, expected: of(size), found: of(found) });
            }
        }
        Ok(Self {
            albedo,
            normals,
            emission,
            motion,
            triangles,
            depth,
            size: UVec2::new(size.width, size.height),
        })
    }
}

impl PixelSurfaces for GBuffer {
    fn size(&self) -> UVec2 {
        self.size
    }

    fn bindings(&self) -> Bindings<'_> {
        vec![
            ("albedo_texture", (&self.albedo).into()),
            ("normal_texture", (&self.normals).into()),
            ("emission_texture", (&self.emission).into()),
            ("triangle_texture", (&self.triangles).into()),
            ("depth_texture", (&self.depth).into()),
        ]
    }
}

/// The compiled kernel.
#[derive(Debug)]
pub struct GBufferPass {
    kernel: RenderKernel,
    shaders: Shaders,
}

impl GBufferPass {
    /// Compiles the kernel; it works for every scene of the same variant.
    ///
    /// # Errors
    /// [`Mismatch::NoRaster`]
    pub fn new(gpu: &Gpu, scene: &dyn SceneSeam) -> Result<Self, Mismatch> {
        let raster = scene.raster_group().ok_or(Mismatch::NoRaster)?;
        let state = RenderState {
            targets: &[
                GBuffer::ALBEDO,
                GBuffer::NORMALS,
                GBuffer::EMISSION,
                GBuffer::MOTION,
                GBuffer::TRIANGLES,
            ],
            depth: Some(wgpu::DepthStencilState {
                format: GBuffer::DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            ..Default::default()
        };
        let name = "frame/gbuffer";
        let kernel = RenderKernel::new(gpu, scene.shaders(), Some(raster), name, name, state);
        Ok(Self { kernel, shaders: scene.shaders().clone() })
    }

    /// Records one render pass that clears and fills the G-buffer.
    ///
    /// # Errors
    /// The scene differs from the one that the kernel was compiled for, or sizes differ.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        view: &View,
        gbuffer: &GBuffer,
    ) -> Result<(), Mismatch> {
        check_shaders(&self.shaders, scene)?;
        check_size("G-buffer", view.size(), gbuffer.size)?;
        let raster = scene.raster_group().ok_or(Mismatch::NoRaster)?;
        let GBuffer { albedo, normals, emission, motion, triangles, .. } = gbuffer;
        let targets = [albedo, normals, emission, motion, triangles];
        let pass = &mut recorder.render("frame/gbuffer", &targets, Some(&gbuffer.depth));
        let bound = [("view", Resource::Uniform(bytemuck::bytes_of(view.data())))];
        self.kernel.draw(pass, Some(raster), &bound, 3 * scene.facts().n_triangles);
        Ok(())
    }
}
