// SPDX-License-Identifier: MIT OR Apache-2.0
//! Prefiltered voxels: three volumes of texels, and how they are bound.

use super::PyramidStorage;
use crate::bindings::lucerna::components::voxel_pyramid::layout as wgsl;
use crate::components::LightVisibility;
use crate::components::voxels::VoxelGrid;
use crate::gpu::{
    Bindings, Gpu, GpuError, OwnedResource, Recorder, Shaders, buffer, storage_buffer,
};
use crate::shader::{SHADOW_CONES, VOLUME_BUFFERS, Variant};
use glam::{UVec3, Vec3};
use half::f16;

pub use wgsl::{PyramidLayout, PyramidLevel, PyramidMip};

/// Bytes of a texel: four 16-bit floats.
const TEXEL_BYTES: u64 = 8;

/// Advice if a volume is too large.
const ADVICE: &str =
    "use fewer cells, fewer levels, an isotropic grid, or textures instead of buffers";

/// Levels, mips and faces of voxels in three volumes; layout in `wgsl/components/voxel_pyramid/layout.wgsl`.
///
/// | volume | texels (bytes: 8 a texel) |
/// |---|---|
/// | base | (x + 2) · (y + 2) · n_faces (z + 2) a level, levels beside each other along y |
/// | mips of odd and of even number | about a fifth of that together |
#[derive(Debug)]
pub struct Pyramid {
    layout: PyramidLayout,
    uniform: wgpu::Buffer,
    volumes: Volumes,
}

#[derive(Debug)]
struct Textures {
    textures: [wgpu::Texture; 3],
    views: [wgpu::TextureView; 3],
    sampler: wgpu::Sampler,
}

#[derive(Debug)]
enum Volumes {
    Textures(Box<Textures>),
    /// The volumes, one after the other.
    Buffer(wgpu::Buffer),
}

/// Which volume holds a mip: `volume_of_mip` of the module.
pub(super) fn volume_of_mip(mip: u32) -> usize {
    if mip == 0 { 0 } else { 2 - (mip as usize & 1) }
}

fn n_texels(size: UVec3) -> u64 {
    size.to_array().into_iter().map(u64::from).product()
}

/// Number of mips of a grid: the last one has one cell.
fn n_mips(size: UVec3) -> u32 {
    32 - (size.max_element() - 1).leading_zeros() + 1
}

/// The layout of the mips of the grids.
fn layout_of(grids: &[VoxelGrid], squared_weights: bool) -> PyramidLayout {
    let none = PyramidLevel { origin: Vec3::ZERO, cell: 1.0, size: UVec3::ONE, n_mips: 0 };
    let no_mip = PyramidMip { first: UVec3::ONE, stride: 0, size: UVec3::ZERO, reserved: 0 };
    let n_faces = grids.first().map_or(1, |grid| grid.n_faces);
    let mut layout = PyramidLayout {
        levels: std::array::from_fn(|_| none),
        mips: std::array::from_fn(|_| no_mip),
        volume_base: UVec3::ONE,
        n_levels: grids.len() as u32,
        volume_odd: UVec3::ONE,
        n_faces,
        volume_even: UVec3::ONE,
        squared_weights: u32::from(squared_weights),
        peak: 0,
        reserved_a: 0,
        reserved_b: 0,
        reserved_c: 0,
    };
    // Where the next block of each volume starts along y.
    let mut next = [0; 3];
    for (level, grid) in grids.iter().enumerate() {
        let n_mips = n_mips(grid.size);
        layout.levels[level] =
            PyramidLevel { origin: grid.origin, cell: grid.cell, size: grid.size, n_mips };
        for mip in 0..n_mips {
            let size = (grid.size + UVec3::splat((1 << mip) - 1)) >> mip;
            let volume = volume_of_mip(mip);
            let padded = size + 2;
            layout.mips[level * wgsl::MAX_MIPS as usize + mip as usize] = PyramidMip {
                first: UVec3::new(1, next[volume] + 1, 1),
                stride: padded.z,
                size,
                reserved: 0,
            };
            next[volume] += padded.y;
            let extent = match volume {
                0 => &mut layout.volume_base,
                1 => &mut layout.volume_odd,
                _ => &mut layout.volume_even,
            };
            *extent = extent.max(UVec3::new(padded.x, next[volume], padded.z * n_faces));
        }
    }
    layout
}

/// Prefiltered voxels could not be created.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PyramidError {
    /// There are too many grids, or none.
    #[error("prefiltered voxels need 1 to 6 grids, not {0}")]
    Grids(usize),
    /// A grid has a size that is not possible.
    #[error("grids of prefiltered voxels need 1 to 256 cells along each axis, not {0}")]
    Cells(UVec3),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl Pyramid {
    /// Creates empty volumes for these grids, from the finest to the coarsest, at most 6, all with the same number of
    /// faces.
    ///
    /// # Errors
    /// [`PyramidError`]: there is no grid or more than 6, one has no cell or more than 256 along an axis, or a volume
    /// is larger than the device allows.
    pub fn new(
        gpu: &Gpu,
        grids: &[VoxelGrid],
        storage: PyramidStorage,
        squared_weights: bool,
    ) -> Result<Self, PyramidError> {
        if !(1..=6).contains(&grids.len()) {
            return Err(PyramidError::Grids(grids.len()));
        }
        let is_outside = |size: &UVec3| size.min_element() == 0 || size.max_element() > 256;
        if let Some(size) = grids.iter().map(|grid| grid.size).find(is_outside) {
            return Err(PyramidError::Cells(size));
        }
        let layout = layout_of(grids, squared_weights);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform = buffer(gpu, "voxel pyramid", size_of::<PyramidLayout>() as u64, usage);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&layout));
        let sizes = [layout.volume_base, layout.volume_odd, layout.volume_even];
        let volumes = match storage {
            PyramidStorage::Textures => textures(gpu, sizes)?,
            PyramidStorage::Buffers => {
                let n: u64 = sizes.into_iter().map(n_texels).sum();
                let usage = wgpu::BufferUsages::COPY_DST;
                let what = "prefiltered voxels";
                Volumes::Buffer(storage_buffer(gpu, what, n * TEXEL_BYTES, usage, ADVICE)?)
            }
        };
        Ok(Self { layout, uniform, volumes })
    }

    /// The layout of the volumes.
    pub fn layout(&self) -> &PyramidLayout {
        &self.layout
    }

    /// A volume (0: all mips 0, 1: the odd mips, 2: the other even mips) as a texture, `rgba16float` with `COPY_SRC`;
    /// None if it is a buffer.
    pub fn texture(&self, volume: usize) -> Option<&wgpu::Texture> {
        match &self.volumes {
            Volumes::Textures(of) => Some(&of.textures[volume]),
            Volumes::Buffer(_) => None,
        }
    }

    /// All three volumes in a buffer with `COPY_SRC`, one after the other, x fastest; None if they are textures.
    pub fn buffer(&self) -> Option<&wgpu::Buffer> {
        match &self.volumes {
            Volumes::Textures(_) => None,
            Volumes::Buffer(buffer) => Some(buffer),
        }
    }

    /// Texels along each axis of the three volumes.
    pub fn volume_sizes(&self) -> [UVec3; 3] {
        [self.layout.volume_base, self.layout.volume_odd, self.layout.volume_even]
    }

    /// Bytes of the three volumes.
    pub fn bytes(&self) -> u64 {
        self.volume_sizes().into_iter().map(|size| TEXEL_BYTES * n_texels(size)).sum()
    }

    /// The layout of levels and mips: a [`PyramidLayout`].
    pub fn uniform(&self) -> &wgpu::Buffer {
        &self.uniform
    }

    /// The variant of kernels that read or write the pyramid.
    pub fn variant(&self, variant: Variant) -> Variant {
        variant.with_if(matches!(self.volumes, Volumes::Buffer(_)), VOLUME_BUFFERS)
    }

    /// The source of kernels that read or write the pyramid and use no scene.
    pub(super) fn shaders(&self) -> Shaders {
        Shaders::new(self.variant(Variant::BASELINE))
    }

    /// Records moving a level's grid to this corner \[m\].
    pub fn move_level(&mut self, recorder: &mut Recorder, level: usize, origin: Vec3) {
        if self.layout.levels[level].origin != origin {
            self.layout.levels[level].origin = origin;
            recorder.upload(&self.uniform, 0, bytemuck::bytes_of(&self.layout));
        }
    }

    /// Records that light is scaled by this peak from here on: a u32, `peak` of the layout. All mips must be computed
    /// again.
    pub(super) fn take_peak(&self, encoder: &mut wgpu::CommandEncoder, peak: &wgpu::Buffer) {
        let at = std::mem::offset_of!(PyramidLayout, peak) as u64;
        encoder.copy_buffer_to_buffer(peak, 0, &self.uniform, at, 4);
    }

    /// The bindings of kernels that read the pyramid: `fields::voxel_pyramid`.
    pub fn field(&self) -> Bindings<'_> {
        let mut bindings: Bindings = vec![("pyramid", (&self.uniform).into())];
        match &self.volumes {
            Volumes::Textures(of) => {
                let names = ["volume_base", "volume_odd", "volume_even"];
                bindings.extend(
                    names.into_iter().zip(&of.views).map(|(name, view)| (name, view.into())),
                );
                bindings.push(("filtering", (&of.sampler).into()));
            }
            Volumes::Buffer(buffer) => bindings.push(("volume_texels", buffer.into())),
        }
        bindings
    }

    /// The bindings of the kernel that computes `mip` from the one below, or from nothing: `fields::pyramid_texels`.
    pub(super) fn filling(&self, mip: u32) -> Bindings<'_> {
        let mut bindings: Bindings = vec![("filled", (&self.uniform).into())];
        match &self.volumes {
            Volumes::Textures(of) => {
                // A kernel that reads no volume gets one that it does not write.
                let from = if mip == 0 { 1 } else { volume_of_mip(mip - 1) };
                bindings.push(("source_volume", (&of.views[from]).into()));
                bindings.push(("target_volume", (&of.views[volume_of_mip(mip)]).into()));
            }
            Volumes::Buffer(buffer) => bindings.push(("filled_texels", buffer.into())),
        }
        bindings
    }

    /// Shadows by cones through the voxels: soft and without noise, but they miss what is smaller than a voxel.
    pub fn visibility(&self) -> LightVisibility {
        let mut bindings = vec![("pyramid", OwnedResource::Buffer(self.uniform.clone()))];
        match &self.volumes {
            Volumes::Textures(of) => {
                let names = ["volume_base", "volume_odd", "volume_even"];
                let views = of.views.iter().cloned().map(OwnedResource::Texture);
                bindings.extend(names.into_iter().zip(views));
                bindings.push(("filtering", OwnedResource::Sampler(of.sampler.clone())));
                LightVisibility::new(&[SHADOW_CONES], bindings)
            }
            Volumes::Buffer(buffer) => {
                bindings.push(("volume_texels", OwnedResource::Buffer(buffer.clone())));
                LightVisibility::new(&[SHADOW_CONES, VOLUME_BUFFERS], bindings)
            }
        }
    }

    /// Writes mip 0 of a level from the CPU, at the next submission: for your own voxels, and for tests.
    ///
    /// `texel`: returns the texel of a cell and a face, as `cone::medium::texel_of_surface` makes it (τ·L, τ).
    pub fn write_base(&self, gpu: &Gpu, level: usize, texel: impl Fn(UVec3, u32) -> [f32; 4]) {
        let entry = self.layout.mips[level * wgsl::MAX_MIPS as usize];
        let size = self.layout.volume_base;
        for face in 0..self.layout.n_faces {
            for z in 0..entry.size.z {
                for y in 0..entry.size.y {
                    let row: Vec<[u16; 4]> = (0..entry.size.x)
                        .map(|x| {
                            texel(UVec3::new(x, y, z), face).map(|v| f16::from_f32(v).to_bits())
                        })
                        .collect();
                    let place = entry.first + UVec3::new(0, y, z + face * entry.stride);
                    let bytes: &[u8] = bytemuck::cast_slice(&row);
                    match &self.volumes {
                        Volumes::Textures(of) => gpu.queue.write_texture(
                            wgpu::TexelCopyTextureInfo {
                                texture: &of.textures[0],
                                mip_level: 0,
                                origin: wgpu::Origin3d { x: place.x, y: place.y, z: place.z },
                                aspect: wgpu::TextureAspect::All,
                            },
                            bytes,
                            wgpu::TexelCopyBufferLayout {
                                offset: 0,
                                bytes_per_row: Some(bytes.len() as u32),
                                rows_per_image: Some(1),
                            },
                            wgpu::Extent3d {
                                width: entry.size.x,
                                height: 1,
                                depth_or_array_layers: 1,
                            },
                        ),
                        // Volume 0 comes first.
                        Volumes::Buffer(buffer) => {
                            let ix = (place.z * size.y + place.y) * size.x + place.x;
                            gpu.queue.write_buffer(buffer, u64::from(ix) * TEXEL_BYTES, bytes);
                        }
                    }
                }
            }
        }
    }
}

fn textures(gpu: &Gpu, sizes: [UVec3; 3]) -> Result<Volumes, GpuError> {
    let limit = gpu.device.limits().max_texture_dimension_3d;
    let mut textures = Vec::new();
    for size in sizes {
        if size.max_element() > limit {
            let (what, edge) = ("prefiltered voxels", size.max_element());
            return Err(GpuError::VolumeTooLarge { what, edge, limit, advice: ADVICE });
        }
        textures.push(gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("prefiltered voxels"),
            size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format: wgpu::TextureFormat::Rgba16Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING
                | wgpu::TextureUsages::STORAGE_BINDING
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        }));
    }
    let textures: [wgpu::Texture; 3] = std::array::from_fn(|ix| textures[ix].clone());
    let views = [0, 1, 2].map(|ix: usize| textures[ix].create_view(&Default::default()));
    let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("voxel pyramid"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    Ok(Volumes::Textures(Box::new(Textures { textures, views, sampler })))
}
