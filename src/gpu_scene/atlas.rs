// SPDX-License-Identifier: MIT OR Apache-2.0
//! All material textures in one array texture, each with its own mips.

use super::GpuSceneError;
use crate::bindings::lucerna::scene::data as wgsl;
use crate::gpu::Gpu;
use crate::scene::{Filter, Image, Scene, TextureRef, Wrap};
use etagere::{AtlasAllocator, size2};
use glam::{UVec2, Vec3};
use std::collections::BTreeMap;

/// What an image's numbers mean, which decides how its mips are averaged.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Encoding {
    /// RGB encoded as sRGB, alpha linear.
    Srgb,
    /// Linear numbers.
    Linear,
}

/// The array texture, and where each image is.
#[derive(Debug)]
pub struct Atlas {
    /// Texels as stored; kernels decode sRGB.
    pub texels: wgpu::TextureView,
    /// Size on the GPU.
    pub bytes: u64,
    places: BTreeMap<(usize, Encoding), Place>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Place {
    layer: u32,
    origin: UVec2,
    size: UVec2,
}

/// An image and its mips, as arranged in the atlas: mip 0, to its right mip 1, below that the
/// others.
struct Block {
    mips: Vec<Mip>,
}

struct Mip {
    size: UVec2,
    rgba: Vec<[u8; 4]>,
}

impl Block {
    fn size(&self) -> UVec2 {
        let rest = &self.mips[1..];
        let width = self.mips[0].size.x + rest.first().map_or(0, |mip| mip.size.x);
        let height = self.mips[0].size.y.max(rest.iter().map(|mip| mip.size.y).sum());
        UVec2::new(width, height)
    }

    /// Offsets of the mips within the block.
    fn offsets(&self) -> Vec<UVec2> {
        let mut at = UVec2::ZERO;
        let mut out = Vec::new();
        for (level, mip) in self.mips.iter().enumerate() {
            out.push(at);
            at += if level == 0 { UVec2::new(mip.size.x, 0) } else { UVec2::new(0, mip.size.y) };
        }
        out
    }
}

impl Atlas {
    /// Packs every image that a material uses, once per encoding in which it is read.
    pub fn build(gpu: &Gpu, scene: &Scene) -> Result<Self, GpuSceneError> {
        let limits = gpu.device.limits();
        let mut blocks = BTreeMap::new();
        for material in &scene.materials {
            let used = [
                (&material.base_color_texture, Encoding::Srgb),
                (&material.metallic_roughness_texture, Encoding::Linear),
                (&material.normal_texture, Encoding::Linear),
                (&material.emission_texture, Encoding::Srgb),
            ];
            for (texture, encoding) in used {
                if let Some(texture) = texture {
                    let image = scene.textures[texture.texture].image;
                    blocks.entry((image, encoding)).or_insert_with(|| {
                        // The block is 1.5 times as wide as its image.
                        block_of(
                            &scene.images[image],
                            encoding,
                            limits.max_texture_dimension_2d / 3 * 2,
                        )
                    });
                }
            }
        }
        let side = blocks
            .values()
            .map(|block| block.size().max_element())
            .max()
            .unwrap_or(1)
            .max(if blocks.len() > 1 { 2048 } else { 1 })
            .min(limits.max_texture_dimension_2d);
        let (places, n_layers) = pack(&blocks, side);
        if n_layers > limits.max_texture_array_layers {
            return Err(GpuSceneError::TextureLimit {
                what: "the material textures",
                detail: format!(
                    "{} images need {n_layers} layers of {side}×{side} texels, but the device allows {}",
                    blocks.len(),
                    limits.max_texture_array_layers
                ),
                advice: "scale the images down",
            });
        }
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("material textures"),
            size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: n_layers },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba8Unorm,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        for (key, block) in &blocks {
            let place = places[key];
            for (mip, offset) in block.mips.iter().zip(block.offsets()) {
                write(gpu, &texture, place.layer, place.origin + offset, mip);
            }
        }
        let texels = texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        Ok(Self {
            texels,
            bytes: 4 * u64::from(side) * u64::from(side) * u64::from(n_layers),
            places,
        })
    }

    /// Number of images in the atlas, counted once per encoding.
    pub fn n_images(&self) -> usize {
        self.places.len()
    }

    /// How a material reads a texture.
    pub fn slot(
        &self,
        scene: &Scene,
        reference: &TextureRef,
        encoding: Encoding,
    ) -> wgsl::TextureSlot {
        let texture = &scene.textures[reference.texture];
        let place = self.places.get(&(texture.image, encoding)).copied().unwrap_or_default();
        let wrap = |mode, mirror, clamp| match mode {
            Wrap::Repeat => 0,
            Wrap::Mirror => mirror,
            Wrap::Clamp => clamp,
        };
        let mut flags = wrap(texture.wrap_u, wgsl::SLOT_MIRROR_U, wgsl::SLOT_CLAMP_U)
            | wrap(texture.wrap_v, wgsl::SLOT_MIRROR_V, wgsl::SLOT_CLAMP_V);
        if texture.filter == Filter::Nearest {
            flags |= wgsl::SLOT_NEAREST;
        }
        if reference.uv_set == 1 {
            flags |= wgsl::SLOT_SECOND_UV;
        }
        let m = reference.uv_from_mesh;
        wgsl::TextureSlot {
            row_u: Vec3::new(m.matrix2.x_axis.x, m.matrix2.y_axis.x, m.translation.x),
            flags,
            row_v: Vec3::new(m.matrix2.x_axis.y, m.matrix2.y_axis.y, m.translation.y),
            layer: place.layer,
            origin: place.origin,
            size: place.size,
        }
    }
}

fn pack(
    blocks: &BTreeMap<(usize, Encoding), Block>,
    side: u32,
) -> (BTreeMap<(usize, Encoding), Place>, u32) {
    // Tall blocks first, because then shelves waste the least space.
    let mut order: Vec<_> = blocks.iter().map(|(key, block)| (*key, block.size())).collect();
    order.sort_by_key(|&(key, size)| (std::cmp::Reverse(size.y), std::cmp::Reverse(size.x), key));
    let mut layers: Vec<AtlasAllocator> = Vec::new();
    let mut places = BTreeMap::new();
    for (key, size) in order {
        let wanted = size2(size.x as i32, size.y as i32);
        let found = layers
            .iter_mut()
            .enumerate()
            .find_map(|(layer, shelves)| Some((layer, shelves.allocate(wanted)?)));
        let (layer, allocation) = found.unwrap_or_else(|| {
            let mut shelves = AtlasAllocator::new(size2(side as i32, side as i32));
            // The side is at least that of the largest block, so any block fits into an empty
            // layer.
            let allocation = shelves.allocate(wanted).expect("a block fits an empty layer");
            layers.push(shelves);
            (layers.len() - 1, allocation)
        });
        let min = allocation.rectangle.min;
        places.insert(
            key,
            Place {
                layer: layer as u32,
                origin: UVec2::new(min.x as u32, min.y as u32),
                size: blocks[&key].mips[0].size,
            },
        );
    }
    (places, layers.len().max(1) as u32)
}

fn write(gpu: &Gpu, texture: &wgpu::Texture, layer: u32, at: UVec2, mip: &Mip) {
    gpu.queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x: at.x, y: at.y, z: layer },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(&mip.rgba),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(4 * mip.size.x),
            rows_per_image: None,
        },
        wgpu::Extent3d { width: mip.size.x, height: mip.size.y, depth_or_array_layers: 1 },
    );
}

/// The image with all its mips, scaled down first if a side is longer than `max_side`.
fn block_of(image: &Image, encoding: Encoding, max_side: u32) -> Block {
    let mut mip = Mip { size: UVec2::new(image.width, image.height), rgba: image.rgba.clone() };
    if mip.size.max_element() > max_side {
        let scale = f64::from(max_side) / f64::from(mip.size.max_element());
        let size = (mip.size.as_dvec2() * scale).floor().as_uvec2().max(UVec2::ONE);
        tracing::warn!("image {}: scaled from {} to {size} texels", image.name, mip.size);
        mip = shrink(&mip, size, encoding);
    }
    let mut mips = vec![mip];
    while let Some(last) = mips.last()
        && last.size != UVec2::ONE
    {
        let next = shrink(last, (last.size / 2).max(UVec2::ONE), encoding);
        mips.push(next);
    }
    Block { mips }
}

/// Averages by area, for odd sizes as well: texel `i` of `n` covers `[i/n, (i+1)/n)` of the larger
/// image.
fn shrink(mip: &Mip, size: UVec2, encoding: Encoding) -> Mip {
    let decode = decode_table(encoding);
    let columns = footprints(mip.size.x, size.x);
    let rows = footprints(mip.size.y, size.y);
    let mut rgba = Vec::with_capacity((size.x * size.y) as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0f32; 4];
            for &(y, weight_y) in row {
                for &(x, weight_x) in column {
                    let texel = mip.rgba[(y * mip.size.x + x) as usize];
                    let weight = weight_x * weight_y;
                    for channel in 0..3 {
                        sum[channel] += weight * decode[texel[channel] as usize];
                    }
                    sum[3] += weight * f32::from(texel[3]) / 255.0;
                }
            }
            let [r, g, b, a] = sum;
            rgba.push([
                encode(r, encoding),
                encode(g, encoding),
                encode(b, encoding),
                encode(a, Encoding::Linear),
            ]);
        }
    }
    Mip { size, rgba }
}

/// For each of `small` texels, which of the `large` texels it covers, and with which share.
fn footprints(large: u32, small: u32) -> Vec<Vec<(u32, f32)>> {
    let scale = f64::from(large) / f64::from(small);
    (0..small)
        .map(|ix| {
            let (from, to) = (f64::from(ix) * scale, f64::from(ix + 1) * scale);
            (from.floor() as u32..(to.ceil() as u32).min(large))
                .map(|texel| {
                    let overlap = to.min(f64::from(texel + 1)) - from.max(f64::from(texel));
                    (texel, (overlap / scale) as f32)
                })
                .collect()
        })
        .collect()
}

fn decode_table(encoding: Encoding) -> [f32; 256] {
    std::array::from_fn(|ix| {
        let value = ix as f32 / 255.0;
        match encoding {
            Encoding::Linear => value,
            Encoding::Srgb if value <= 0.04045 => value / 12.92,
            Encoding::Srgb => ((value + 0.055) / 1.055).powf(2.4),
        }
    })
}

fn encode(value: f32, encoding: Encoding) -> u8 {
    let encoded = match encoding {
        Encoding::Linear => value,
        Encoding::Srgb if value <= 0.003_130_8 => value * 12.92,
        Encoding::Srgb => 1.055 * value.powf(1.0 / 2.4) - 0.055,
    };
    (encoded.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Image {
        let rgba =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y));
        Image { name: "test".into(), width, height, rgba: rgba.collect() }
    }

    #[test]
    fn mips_average_light_not_codes() {
        let checker = image(2, 2, |x, y| if (x + y) % 2 == 0 { [255; 4] } else { [0, 0, 0, 255] });
        // Half of the light is 188 in sRGB, half of the number is 128.
        let srgb = block_of(&checker, Encoding::Srgb, 4096);
        assert_eq!(srgb.mips[1].rgba, [[188, 188, 188, 255]]);
        let linear = block_of(&checker, Encoding::Linear, 4096);
        assert_eq!(linear.mips[1].rgba, [[128, 128, 128, 255]]);
    }

    #[test]
    fn odd_sizes_lose_nothing() {
        // One bright texel of 5: the 2 texels of the next mip share it by area.
        let line = image(5, 1, |x, _| if x == 2 { [255; 4] } else { [0; 4] });
        let block = block_of(&line, Encoding::Linear, 4096);
        assert_eq!(block.mips[1].size, UVec2::new(2, 1));
        // 0.5 of 2.5 texels each.
        assert_eq!(block.mips[1].rgba, [[51; 4], [51; 4]]);
        assert_eq!(block.mips[2].rgba, [[51; 4]]);
    }

    #[test]
    fn blocks_hold_all_their_mips() {
        for (width, height) in [(1, 1), (1, 64), (64, 1), (37, 19), (128, 128)] {
            let block = block_of(&image(width, height, |_, _| [9; 4]), Encoding::Linear, 4096);
            let size = block.size();
            for (mip, offset) in block.mips.iter().zip(block.offsets()) {
                assert!(
                    (offset + mip.size).cmple(size).all(),
                    "{width}×{height}: {offset} {}",
                    mip.size
                );
            }
        }
    }
}
