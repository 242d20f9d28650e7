// SPDX-License-Identifier: MIT OR Apache-2.0
//! Creation of the crate's buffers and textures.

use super::{Gpu, GpuError};
use glam::UVec2;

/// A zeroed buffer.
pub(crate) fn buffer(
    gpu: &Gpu,
    label: &'static str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    let size = size.next_multiple_of(4).max(16);
    #[cfg(feature = "testing")]
    return super::guards::buffer(gpu, label, size, usage);
    #[cfg(not(feature = "testing"))]
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}

/// A zeroed storage buffer that can be copied from. `usage`: its other usages; `advice`: what to do if the device
/// cannot bind this many bytes ([`GpuError::TooLarge`]).
pub(crate) fn storage_buffer(
    gpu: &Gpu,
    what: &'static str,
    bytes: u64,
    usage: wgpu::BufferUsages,
    advice: &'static str,
) -> Result<wgpu::Buffer, GpuError> {
    check_binding(gpu, what, bytes, advice)?;
    let usage = usage | wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC;
    Ok(buffer(gpu, what, bytes, usage))
}

/// Fails if the device cannot bind a storage buffer of this size.
pub(crate) fn check_binding(
    gpu: &Gpu,
    what: &'static str,
    bytes: u64,
    advice: &'static str,
) -> Result<(), GpuError> {
    let limits = gpu.device.limits();
    let limit = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if bytes > limit { Err(GpuError::TooLarge { what, bytes, limit, advice }) } else { Ok(()) }
}

/// Fails if a picture of this size \[pixels\] has none.
pub(crate) fn check_not_empty(size: UVec2) -> Result<(), GpuError> {
    let (width, height) = (size.x, size.y);
    if size.min_element() == 0 { Err(GpuError::EmptyPicture { width, height }) } else { Ok(()) }
}

/// Fails if the device has no textures of this size \[pixels\].
pub(crate) fn check_picture(gpu: &Gpu, size: UVec2) -> Result<(), GpuError> {
    check_not_empty(size)?;
    let limit = gpu.device.limits().max_texture_dimension_2d;
    let (width, height) = (size.x, size.y);
    if size.max_element() > limit {
        return Err(GpuError::PictureTooLarge { width, height, limit });
    }
    Ok(())
}

/// Size of a picture's texture.
pub(crate) fn extent(size: UVec2) -> wgpu::Extent3d {
    wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 }
}

/// A texture for a technique's light or a picture: `rgba32float`, which kernels write and read, with the radiance
/// \[W·sr⁻¹·m⁻²\] of each pixel. `size` \[pixels\].
pub fn radiance_target(gpu: &Gpu, label: &str, size: UVec2) -> wgpu::TextureView {
    target(gpu, label, size, wgpu::TextureFormat::Rgba32Float)
}

/// A texture of a picture's size that kernels write and read.
pub(crate) fn target(
    gpu: &Gpu,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
) -> wgpu::TextureView {
    let copied = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST;
    picture_texture(gpu, label, size, format, copied | wgpu::TextureUsages::STORAGE_BINDING)
}

/// A texture of a picture's size, without mips, that shaders read.
pub(crate) fn picture_texture(
    gpu: &Gpu,
    label: &str,
    size: UVec2,
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}
