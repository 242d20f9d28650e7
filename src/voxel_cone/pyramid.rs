//! Prefiltered voxels: three volumes of texels, and how they are bound.

use super::settings::PyramidStorage;
use crate::bindings::baseline::kernels::voxel_cone as kernels;
use crate::bindings::baseline::lucerna::cone::pyramid as wgsl;
use crate::bindings::pyramid_buffer::kernels::voxel_cone as buffer_kernels;
use crate::gpu::{Gpu, GpuError};
use crate::pass::{buffer, storage_buffer};
use crate::voxel::VoxelGrid;
use glam::{UVec3, Vec3};
use half::f16;

pub use wgsl::{PyramidLayout, PyramidLevel, PyramidMip};

/// Bytes of a texel: four 16-bit floats.
const TEXEL_BYTES: u64 = 8;

/// Said where a volume is too large.
const ADVICE: &str =
    "use fewer cells, fewer levels, an isotropic grid, or textures in the place of buffers";

/// Levels, mips and faces of voxels in three volumes; layout in `wgsl/cone/pyramid.wgsl`.
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
    Buffers([wgpu::Buffer; 3]),
}

/// Which volume holds a mip: `volume_of_mip` of the module.
pub(super) fn volume_of_mip(mip: u32) -> usize {
    if mip == 0 { 0 } else { 2 - (mip as usize & 1) }
}

/// Mips of a grid: the last has one cell.
fn n_mips(size: UVec3) -> u32 {
    32 - (size.max_element() - 1).leading_zeros() + 1
}

/// Where the mips of the grids stand.
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
    // Where the next block of each volume begins along y.
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

impl Pyramid {
    /// Empty volumes for these grids, from the finest to the coarsest, at most 6, all with as many faces.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::VolumeTooLarge`]: a volume is larger than the device takes.
    ///
    /// # Panics
    /// If there is no grid or more than 6, or one has no cell or more than 256 along an axis.
    pub fn new(
        gpu: &Gpu,
        grids: &[VoxelGrid],
        storage: PyramidStorage,
        squared_weights: bool,
    ) -> Result<Self, GpuError> {
        assert!((1..=6).contains(&grids.len()), "1 to 6 grids");
        let mut sizes = grids.iter().map(|grid| grid.size);
        assert!(
            sizes.all(|size| size.min_element() > 0 && size.max_element() <= 256),
            "1 to 256 cells"
        );
        let layout = layout_of(grids, squared_weights);
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let uniform = buffer(gpu, "voxel pyramid", size_of::<PyramidLayout>() as u64, usage);
        gpu.queue.write_buffer(&uniform, 0, bytemuck::bytes_of(&layout));
        let sizes = [layout.volume_base, layout.volume_odd, layout.volume_even];
        let volumes = match storage {
            PyramidStorage::Textures => textures(gpu, sizes)?,
            PyramidStorage::Buffers => {
                let make = |size: UVec3| {
                    let n = u64::from(size.x) * u64::from(size.y) * u64::from(size.z);
                    let usage = wgpu::BufferUsages::COPY_DST;
                    storage_buffer(gpu, "prefiltered voxels", n * TEXEL_BYTES, usage, ADVICE)
                };
                Volumes::Buffers([make(sizes[0])?, make(sizes[1])?, make(sizes[2])?])
            }
        };
        Ok(Self { layout, uniform, volumes })
    }

    /// Where everything stands.
    pub fn layout(&self) -> &PyramidLayout {
        &self.layout
    }

    /// A volume (0: all mips 0, 1: those of odd number, 2: the other even ones) as a texture, `rgba16float` with
    /// `COPY_SRC`; None if it is a buffer.
    pub fn texture(&self, volume: usize) -> Option<&wgpu::Texture> {
        match &self.volumes {
            Volumes::Textures(of) => Some(&of.textures[volume]),
            Volumes::Buffers(_) => None,
        }
    }

    /// The same as a buffer of as many texels, x fastest, with `COPY_SRC`; None if it is a texture.
    pub fn buffer(&self, volume: usize) -> Option<&wgpu::Buffer> {
        match &self.volumes {
            Volumes::Textures(_) => None,
            Volumes::Buffers(buffers) => Some(&buffers[volume]),
        }
    }

    /// Bytes of the three volumes.
    pub fn bytes(&self) -> u64 {
        [self.layout.volume_base, self.layout.volume_odd, self.layout.volume_even]
            .iter()
            .map(|size| TEXEL_BYTES * size.to_array().map(u64::from).iter().product::<u64>())
            .sum()
    }

    /// Where levels and mips stand: a [`PyramidLayout`].
    pub(super) fn uniform(&self) -> &wgpu::Buffer {
        &self.uniform
    }

    /// The variant that kernels need which read or make it.
    pub(crate) fn variant(&self) -> &'static str {
        match self.volumes {
            Volumes::Textures(_) => "",
            Volumes::Buffers(_) => "pyramid_buffer",
        }
    }

    /// Puts a level's grid elsewhere \[m\].
    pub(super) fn move_level(&mut self, gpu: &Gpu, level: usize, origin: Vec3) {
        if self.layout.levels[level].origin != origin {
            self.layout.levels[level].origin = origin;
            gpu.queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&self.layout));
        }
    }

    /// Records that light is scaled by this peak from here on, a u32: `peak` of the layout. All mips must be made anew.
    pub(super) fn take_peak(&self, encoder: &mut wgpu::CommandEncoder, peak: &wgpu::Buffer) {
        let at = std::mem::offset_of!(PyramidLayout, peak) as u64;
        encoder.copy_buffer_to_buffer(peak, 0, &self.uniform, at, 4);
    }

    /// Bind group 2 of kernels that read it.
    pub(crate) fn reading(&self, gpu: &Gpu) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let device = &gpu.device;
        let pyramid = self.uniform.as_entire_buffer_binding();
        let bind = |layout: &wgpu::BindGroupLayout, entries: &[wgpu::BindGroupEntry]| {
            let label = Some("voxel pyramid");
            device.create_bind_group(&wgpu::BindGroupDescriptor { label, layout, entries })
        };
        match &self.volumes {
            Volumes::Textures(of) => {
                let Textures { views: [base, odd, even], sampler, .. } = &**of;
                use kernels::trace as kernel;
                let layout = kernel::WgpuBindGroup2::get_bind_group_layout(device);
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        volume_base: base,
                        volume_odd: odd,
                        volume_even: even,
                        filtering: sampler,
                    });
                let group = bind(&layout, &entries.into_array());
                (layout, group)
            }
            Volumes::Buffers([base, odd, even]) => {
                use buffer_kernels::trace as kernel;
                let layout = kernel::WgpuBindGroup2::get_bind_group_layout(device);
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        volume_base: base.as_entire_buffer_binding(),
                        volume_odd: odd.as_entire_buffer_binding(),
                        volume_even: even.as_entire_buffer_binding(),
                    });
                let group = bind(&layout, &entries.into_array());
                (layout, group)
            }
        }
    }

    /// Bind group 2 of the kernel that fills mip 0.
    pub(super) fn filling(&self, gpu: &Gpu) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let device = &gpu.device;
        let pyramid = self.uniform.as_entire_buffer_binding();
        let (layout, entries) = match &self.volumes {
            Volumes::Textures(of) => {
                use kernels::fill as kernel;
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        target_volume: &of.views[0],
                    });
                (kernel::WgpuBindGroup2::get_bind_group_layout(device), entries.into_array())
            }
            Volumes::Buffers(buffers) => {
                use buffer_kernels::fill as kernel;
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        target_volume: buffers[0].as_entire_buffer_binding(),
                    });
                (kernel::WgpuBindGroup2::get_bind_group_layout(device), entries.into_array())
            }
        };
        let label = Some("voxel pyramid, mip 0");
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label,
            layout: &layout,
            entries: &entries,
        });
        (layout, group)
    }

    /// Layout of bind group 2 of the kernel that makes a mip from the one below, and the group for
    /// `mip` ≥ 1.
    pub(super) fn prefiltering(
        &self,
        gpu: &Gpu,
        mip: u32,
    ) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
        let device = &gpu.device;
        let pyramid = self.uniform.as_entire_buffer_binding();
        let (from, to) = (volume_of_mip(mip - 1), volume_of_mip(mip));
        let (layout, entries) = match &self.volumes {
            Volumes::Textures(of) => {
                use kernels::prefilter as kernel;
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        source: &of.views[from],
                        target_volume: &of.views[to],
                    });
                (kernel::WgpuBindGroup2::get_bind_group_layout(device), entries.into_array())
            }
            Volumes::Buffers(buffers) => {
                use buffer_kernels::prefilter as kernel;
                let entries =
                    kernel::WgpuBindGroup2Entries::new(kernel::WgpuBindGroup2EntriesParams {
                        pyramid,
                        source: buffers[from].as_entire_buffer_binding(),
                        target_volume: buffers[to].as_entire_buffer_binding(),
                    });
                (kernel::WgpuBindGroup2::get_bind_group_layout(device), entries.into_array())
            }
        };
        let label = Some("voxel pyramid, mips");
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label,
            layout: &layout,
            entries: &entries,
        });
        (layout, group)
    }

    /// Writes mip 0 of a level from the CPU, at the next submission: for voxels of one's own, and for tests.
    ///
    /// `texel`: of a cell and a face, as `cone::medium::texel_of_surface` makes it (τ·L, τ).
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
                        Volumes::Buffers(buffers) => {
                            let ix = (place.z * size.y + place.y) * size.x + place.x;
                            gpu.queue.write_buffer(&buffers[0], u64::from(ix) * TEXEL_BYTES, bytes);
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
