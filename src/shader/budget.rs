// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a kernel uses, and what baseline WebGPU allows.

/// Limits per shader stage and pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Storage buffers per stage.
    pub storage_buffers: u32,
    /// Storage buffers per stage that the scene seam may use.
    pub seam_storage_buffers: u32,
    /// Storage textures per stage.
    pub storage_textures: u32,
    /// Sampled textures per stage.
    pub sampled_textures: u32,
    /// Samplers per stage.
    pub samplers: u32,
    /// Uniform buffers per stage.
    pub uniform_buffers: u32,
    /// Invocations per workgroup.
    pub workgroup_invocations: u32,
    /// Bytes of workgroup memory.
    pub workgroup_bytes: u32,
}

impl Budget {
    /// WebGPU's default limits, and the seam's share of the storage buffers.
    pub const BASELINE: Self = Self {
        storage_buffers: 8,
        seam_storage_buffers: 5,
        storage_textures: 4,
        sampled_textures: 16,
        samplers: 16,
        uniform_buffers: 12,
        workgroup_invocations: 256,
        workgroup_bytes: 16 * 1024,
    };
}

/// What a composed kernel declares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Resources {
    /// Storage buffers, the seam's included.
    pub storage_buffers: u32,
    /// Storage buffers of group 0.
    pub seam_storage_buffers: u32,
    /// Storage textures.
    pub storage_textures: u32,
    /// Sampled textures.
    pub sampled_textures: u32,
    /// Samplers.
    pub samplers: u32,
    /// Uniform buffers.
    pub uniform_buffers: u32,
    /// Invocations per workgroup (0: not a compute kernel).
    pub workgroup_invocations: u32,
    /// Bytes of workgroup memory, each variable rounded up to 16.
    pub workgroup_bytes: u32,
    /// The kernel uses atomics on a texture.
    pub texture_atomics: bool,
}
