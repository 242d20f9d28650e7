// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the host must know about a composed module: its entry points, and its bindings with all that a layout needs.

use std::borrow::Cow;

/// The bindings and entry points of a composed module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Interface {
    /// By group and number.
    pub bindings: Cow<'static, [Binding]>,
    /// In the order of the text.
    pub entry_points: Cow<'static, [EntryPoint]>,
}

/// An entry point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct EntryPoint {
    /// The function's name.
    pub name: Cow<'static, str>,
    /// Its stage.
    pub stage: Stage,
    /// Workgroup size along each axis (zeros if the stage has none).
    pub workgroup_size: [u32; 3],
}

/// A stage of a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// `@vertex`
    Vertex,
    /// `@fragment`
    Fragment,
    /// `@compute`
    Compute,
}

/// A binding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Bind group: 0 is the scene's, 1 the kernel's, 2 the pixels', 3 the fields'.
    pub group: u32,
    /// Number within the group.
    pub binding: u32,
    /// The variable's name in the source.
    pub name: Cow<'static, str>,
    /// What is bound.
    pub kind: BindingKind,
}

/// What is bound to a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `var<uniform>`
    Uniform {
        /// Size of its type.
        bytes: u32,
    },
    /// `var<storage>`
    Storage {
        /// Whether the access is `read` only.
        read_only: bool,
        /// Size of its type, where a runtime-sized array counts as one element.
        bytes: u32,
    },
    /// A texture that is sampled or loaded from.
    Texture {
        /// Its shape.
        dimension: Dimension,
        /// The type of its texels.
        texels: Texels,
    },
    /// A storage texture.
    StorageTexture {
        /// Its shape.
        dimension: Dimension,
        /// As WGSL names it: `rgba16float`.
        format: &'static str,
        /// How it is used.
        access: Access,
    },
    /// A sampler.
    Sampler {
        /// Whether it compares depths.
        compares: bool,
    },
    /// An acceleration structure for ray queries.
    AccelerationStructure,
}

/// Shape of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// `texture_1d`
    D1,
    /// `texture_2d`
    D2,
    /// `texture_2d_array`
    D2Array,
    /// `texture_cube`
    Cube,
    /// `texture_cube_array`
    CubeArray,
    /// `texture_3d`
    D3,
}

/// Texels of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texels {
    /// `f32`; `filtered`: the shader reads it through a sampler, so its format must be filterable.
    Float {
        /// Whether the shader reads it through a sampler.
        filtered: bool,
    },
    /// `i32`
    Sint,
    /// `u32`
    Uint,
    /// A depth.
    Depth,
}

/// How a storage texture is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// `read`
    Read,
    /// `write`
    Write,
    /// `read_write`
    ReadWrite,
}

impl BindingKind {
    /// `uniform buffer`, `storage buffer, read`, `texture`, …
    pub fn in_words(&self) -> &'static str {
        match self {
            Self::Uniform { .. } => "uniform buffer",
            Self::Storage { read_only: true, .. } => "storage buffer, read",
            Self::Storage { read_only: false, .. } => "storage buffer, read and write",
            Self::Texture { .. } => "texture",
            Self::StorageTexture { .. } => "storage texture",
            Self::Sampler { .. } => "sampler",
            Self::AccelerationStructure => "acceleration structure",
        }
    }
}

impl Interface {
    /// The bindings of a group.
    pub fn group(&self, group: u32) -> impl Iterator<Item = &Binding> {
        self.bindings.iter().filter(move |binding| binding.group == group)
    }
}
