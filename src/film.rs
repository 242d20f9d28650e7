// SPDX-License-Identifier: MIT OR Apache-2.0
//! Sums of samples, on the GPU and as pictures.

use crate::gpu::{Gpu, buffer};
use crate::picture::Picture;
use glam::{UVec2, Vec3};
use std::f32::consts::PI;

pub use crate::bindings::lucerna::frame::pixel_sums::PixelSums;

/// Pixels of one buffer: 80 MiB, well below WebGPU's 128 MiB for a binding.
const STRIPE_PIXELS: u32 = 1 << 20;

/// The pixels of a picture, in stripes that each fit one binding.
#[derive(Debug)]
pub struct Film {
    size: UVec2,
    n_lanes: u32,
    stripes: Vec<Stripe>,
}

/// Some rows of a [`Film`].
#[derive(Debug)]
pub struct Stripe {
    /// First row in the picture.
    pub first_row: u32,
    /// Rows.
    pub n_rows: u32,
    /// [`PixelSums`] row by row, the lanes of a pixel next to each other; initially zero.
    pub sums: wgpu::Buffer,
}

impl Film {
    /// A black film. `size`: at least 1×1.
    pub fn new(gpu: &Gpu, size: UVec2) -> Self {
        Self::with_lanes(gpu, size, 1)
    }

    /// As [`Self::new`], with `n_lanes` (at least 1) sums for each pixel, which share its samples. Without lanes, small
    /// pictures have too few pixels to fill a device.
    pub fn with_lanes(gpu: &Gpu, size: UVec2, n_lanes: u32) -> Self {
        let rows = (STRIPE_PIXELS / (size.x * n_lanes).max(1)).max(1);
        let stripes = (0..size.y)
            .step_by(rows as usize)
            .map(|first_row| {
                let n_rows = rows.min(size.y - first_row);
                let n_sums = u64::from(n_rows) * u64::from(size.x) * u64::from(n_lanes);
                let sums = buffer(
                    gpu,
                    "pixel sums",
                    n_sums * size_of::<PixelSums>() as u64,
                    wgpu::BufferUsages::STORAGE
                        | wgpu::BufferUsages::COPY_SRC
                        | wgpu::BufferUsages::COPY_DST,
                );
                Stripe { first_row, n_rows, sums }
            })
            .collect();
        Self { size, n_lanes, stripes }
    }

    /// Width and height \[pixels\].
    pub fn size(&self) -> UVec2 {
        self.size
    }

    /// Records clearing all sums to zero.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        for stripe in &self.stripes {
            encoder.clear_buffer(&stripe.sums, 0, None);
        }
    }

    /// Sums for each pixel.
    pub fn n_lanes(&self) -> u32 {
        self.n_lanes
    }

    /// The stripes from top to bottom.
    pub fn stripes(&self) -> &[Stripe] {
        &self.stripes
    }
}

/// Sums of several films in 64 bits, for more samples than 32-bit floats can add up precisely.
#[derive(Clone, Debug, Default)]
pub struct LongSums {
    /// For each pixel: light, depth, albedo, normal, openness.
    values: Vec<[f64; 17]>,
    /// For each pixel: samples, rejected ones, surfaces.
    counts: Vec<[u64; 3]>,
}

impl LongSums {
    /// Sums that are zero.
    pub fn new(n_pixels: usize) -> Self {
        Self { values: vec![[0.0; 17]; n_pixels], counts: vec![[0; 3]; n_pixels] }
    }

    /// Adds a film's sums, pixel by pixel, `n_lanes` for each.
    ///
    /// # Panics
    /// If `n_lanes` is 0, or there are more sums than pixels.
    pub fn add(&mut self, sums: &[PixelSums], n_lanes: u32) {
        for (ix, pixel) in sums.iter().enumerate() {
            let ix = ix / n_lanes as usize;
            let (values, counts) = (&mut self.values[ix], &mut self.counts[ix]);
            let vectors = [pixel.emitted, pixel.direct, pixel.indirect, pixel.albedo, pixel.normal];
            let scalars = [pixel.depth, pixel.openness];
            let all = vectors.iter().flat_map(|vector| vector.to_array()).chain(scalars);
            for (sum, value) in values.iter_mut().zip(all) {
                *sum += f64::from(value);
            }
            let n = [pixel.n_samples, pixel.n_rejected, pixel.n_surfaces];
            for (sum, value) in counts.iter_mut().zip(n) {
                *sum += u64::from(value);
            }
        }
    }

    /// The sums, rounded to 32 bits (counts saturate).
    pub fn rounded(&self) -> Vec<PixelSums> {
        let count = |n: u64| u32::try_from(n).unwrap_or(u32::MAX);
        let pixel = |(values, counts): (&[f64; 17], &[u64; 3])| {
            let vector = |ix: usize| {
                glam::DVec3::new(values[3 * ix], values[3 * ix + 1], values[3 * ix + 2]).as_vec3()
            };
            PixelSums {
                emitted: vector(0),
                n_samples: count(counts[0]),
                direct: vector(1),
                n_rejected: count(counts[1]),
                indirect: vector(2),
                depth: values[15] as f32,
                albedo: vector(3),
                n_surfaces: count(counts[2]),
                normal: vector(4),
                openness: values[16] as f32,
            }
        };
        self.values.iter().zip(&self.counts).map(pixel).collect()
    }
}

/// What a picture shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// Emitted + direct + indirect radiance [W·sr⁻¹·m⁻²].
    #[default]
    Beauty,
    /// Radiance seen directly from emitters and the sky.
    Emitted,
    /// Radiance reflected once.
    Direct,
    /// Radiance reflected more than once.
    Indirect,
    /// Irradiance at the first surface [W·m⁻²]; needs [`crate::techniques::reference::ReferenceSettings::irradiance`].
    Irradiance,
    /// Base colour of the first surface, 0 where there is none.
    Albedo,
    /// World-space shading normal of the first surface, towards the camera; 0 where there is none.
    Normal,
    /// Distance along the view axis \[m\], in all three components; 0 where there is no surface.
    Depth,
    /// Ambient occlusion as openness, in all three components: the cosine-weighted share of the first surface's
    /// hemisphere in which there is nothing within the requested distance
    /// ([`crate::techniques::reference::ReferenceSettings::occlusion_distance`],
    /// [`crate::frame::ViewSettings::occlusion_distance`]); 1 where there is no surface, or if the technique does not
    /// compute it.
    Openness,
}

/// Turns sums into a picture: means over samples; for normal and depth, over the samples that hit a surface.
///
/// # Panics
/// If there is not one sum for each pixel ([`LongSums`] adds up lanes).
pub fn resolve(sums: &[PixelSums], size: UVec2, channel: Channel) -> Picture {
    assert_eq!(sums.len(), size.element_product() as usize, "sums for {size} pixels");
    let rgb = sums
        .iter()
        .map(|pixel| {
            let per_sample = 1.0 / pixel.n_samples.saturating_sub(pixel.n_rejected).max(1) as f32;
            // A sample whose light was rejected still has a surface.
            let per_ray = 1.0 / pixel.n_samples.max(1) as f32;
            let per_surface = 1.0 / pixel.n_surfaces.max(1) as f32;
            match channel {
                Channel::Beauty => (pixel.emitted + pixel.direct + pixel.indirect) * per_sample,
                Channel::Emitted => pixel.emitted * per_sample,
                Channel::Direct => pixel.direct * per_sample,
                Channel::Indirect => pixel.indirect * per_sample,
                Channel::Irradiance => PI * (pixel.direct + pixel.indirect) * per_sample,
                Channel::Albedo => pixel.albedo * per_ray,
                Channel::Normal => (pixel.normal * per_surface).normalize_or_zero(),
                Channel::Depth => Vec3::splat(pixel.depth * per_surface),
                Channel::Openness => Vec3::splat(pixel.openness * per_ray),
            }
        })
        .collect();
    Picture { width: size.x, height: size.y, rgb }
}
