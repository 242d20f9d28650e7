// SPDX-License-Identifier: MIT OR Apache-2.0
//! The sky's image, and the distribution from which its directions are sampled.
//!
//! [`sky_distribution`] computes the texture that the functions of `wgsl/sky/environment.wgsl` read, if you use them in
//! your own renderer.

use super::GpuSceneError;
use super::lights::luminance;
use crate::gpu::Gpu;
use crate::scene::Sky;
use glam::{UVec2, Vec3};
use std::f64::consts::PI;
use wgpu::util::DeviceExt;

/// Radiance and cumulative distribution as textures (1×1 if the sky is constant).
#[derive(Debug)]
pub(super) struct SkyTextures {
    pub image: wgpu::TextureView,
    /// (width + 1) × height, r32float: column 0 is the cumulative distribution over rows, the other columns are those
    /// within each row.
    pub distribution: wgpu::TextureView,
    /// Size of the image in texels.
    pub size: UVec2,
    /// Mean over the sphere.
    pub mean_luminance: f32,
}

impl SkyTextures {
    pub fn upload(gpu: &Gpu, sky: &Sky) -> Result<Self, GpuSceneError> {
        let constant;
        let (width, height, rgb, mean) = match sky {
            Sky::Constant(radiance) => {
                constant = [*radiance];
                (1, 1, constant.as_slice(), luminance(*radiance))
            }
            Sky::Image { width, height, rgb } => {
                (*width, *height, rgb.as_slice(), mean_luminance(*width, *height, rgb))
            }
        };
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width + 1 > limit || height > limit {
            return Err(GpuSceneError::TextureLimit {
                what: "the sky's image",
                detail: format!(
                    "{width}×{height} texels, but the device allows {limit} per side (one less in width)"
                ),
                advice: "scale the image down",
            });
        }
        let texels: Vec<[f32; 4]> = rgb.iter().map(|c| c.extend(1.0).to_array()).collect();
        let image = upload(
            gpu,
            "sky",
            width,
            height,
            wgpu::TextureFormat::Rgba32Float,
            bytemuck::cast_slice(&texels),
        );
        let table = sky_distribution(width, height, rgb);
        let distribution = upload(
            gpu,
            "sky distribution",
            width + 1,
            height,
            wgpu::TextureFormat::R32Float,
            bytemuck::cast_slice(&table),
        );
        Ok(Self { image, distribution, size: UVec2::new(width, height), mean_luminance: mean })
    }
}

fn upload(
    gpu: &Gpu,
    label: &str,
    width: u32,
    height: u32,
    format: wgpu::TextureFormat,
    bytes: &[u8],
) -> wgpu::TextureView {
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytes,
    );
    texture.create_view(&Default::default())
}

/// Solid angle of a texel in row `y`, up to a common factor.
fn row_weight(y: u32, height: u32) -> f64 {
    (PI * (f64::from(y) + 0.5) / f64::from(height)).sin()
}

fn mean_luminance(width: u32, height: u32, rgb: &[Vec3]) -> f32 {
    let mut sum = 0.0;
    let mut weights = 0.0;
    for (y, row) in (0..height).zip(rgb.chunks(width as usize)) {
        let weight = row_weight(y, height);
        sum += weight * row.iter().map(|&c| f64::from(luminance(c))).sum::<f64>();
        weights += weight * f64::from(width);
    }
    (sum / weights) as f32
}

/// The distribution of an equirectangular sky's directions by luminance × solid angle, as `wgsl/sky/environment.wgsl` reads it from an
/// `r32float` texture of (`width` + 1) × `height` texels; row after row, top row first.
///
/// Column 0 is the cumulative distribution over the rows, the other columns are those over the columns within each row;
/// the last value of each is exactly 1. If a row, or the whole sky, is black, its distribution is uniform.
///
/// `rgb`: radiance of the `width` · `height` texels, finite and not negative, row after row from +Y down; both sizes at least 1.
/// (M. Pharr, W. Jakob, G. Humphreys, "Physically Based Rendering", 4th ed., §A.5.6 and §12.5.2, piecewise constant.)
///
/// # Panics
/// If `rgb` has another number of texels.
pub fn sky_distribution(width: u32, height: u32, rgb: &[Vec3]) -> Vec<f32> {
    assert_eq!(rgb.len(), width as usize * height as usize, "texels of {width} × {height}");
    let mut table = Vec::with_capacity((width as usize + 1) * height as usize);
    let sums: Vec<f64> = (0..height)
        .zip(rgb.chunks(width as usize))
        .map(|(y, row)| {
            row_weight(y, height) * row.iter().map(|&c| f64::from(luminance(c))).sum::<f64>()
        })
        .collect();
    let total: f64 = sums.iter().sum();
    let mut below = 0.0;
    for (y, row) in rgb.chunks(width as usize).enumerate() {
        below += sums[y];
        table.push(cumulative(below, total, y + 1, height as usize));
        let row_total: f64 = row.iter().map(|&c| f64::from(luminance(c))).sum();
        let mut left = 0.0;
        for (x, &color) in row.iter().enumerate() {
            left += f64::from(luminance(color));
            table.push(cumulative(left, row_total, x + 1, width as usize));
        }
    }
    table
}

/// `part / total`, uniform where the total is zero, exactly 1 at the end.
fn cumulative(part: f64, total: f64, n_done: usize, n: usize) -> f32 {
    if n_done == n {
        1.0
    } else if total > 0.0 {
        (part / total) as f32
    } else {
        (n_done as f64 / n as f64) as f32
    }
}
