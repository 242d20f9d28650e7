// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a composed module asks of its host: entry points, and bindings with all that a layout needs.

use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, Handle, ImageClass, ImageDimension, Module, ScalarKind, StorageAccess, TypeInner,
};
use std::borrow::Cow;
use std::collections::BTreeSet;

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
    /// When it runs.
    pub stage: Stage,
    /// Invocations along each axis (zeros where the stage has none).
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
        /// `read` alone.
        read_only: bool,
        /// Size of its type, a runtime array having one element.
        bytes: u32,
    },
    /// A texture that is sampled or loaded from.
    Texture {
        /// Its shape.
        dimension: Dimension,
        /// What its texels are.
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
        /// It compares depths.
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
    /// `f32`; `filtered`: the shader samples it through a sampler, and so its format must be one that can be filtered.
    Float {
        /// The shader samples it.
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
    /// Reads it from a validated module.
    pub fn of(module: &Module, info: &ModuleInfo) -> Self {
        let sampled: BTreeSet<Handle<naga::GlobalVariable>> = (0..module.entry_points.len())
            .flat_map(|ix| info.get_entry_point(ix).sampling_set.iter())
            .filter(|key| {
                !matches!(
                    module.types[module.global_variables[key.sampler].ty].inner,
                    TypeInner::Sampler { comparison: true }
                )
            })
            .map(|key| key.image)
            .collect();
        let mut layouter = naga::proc::Layouter::default();
        let is_laid_out = layouter.update(module.to_ctx()).is_ok();
        debug_assert!(is_laid_out, "the module was validated");
        let mut bindings: Vec<_> = module
            .global_variables
            .iter()
            .filter_map(|(handle, variable)| {
                let binding = variable.binding?;
                let bytes = layouter[variable.ty].size;
                let kind = match variable.space {
                    AddressSpace::Uniform => BindingKind::Uniform { bytes },
                    AddressSpace::Storage { access } => BindingKind::Storage {
                        read_only: !access.contains(StorageAccess::STORE),
                        bytes,
                    },
                    _ => {
                        kind_of_handle(&module.types[variable.ty].inner, sampled.contains(&handle))?
                    }
                };
                // Composed names carry the module in an encoded suffix.
                let name = variable.name.as_deref().unwrap_or_default();
                let name = name.split("X_naga_oil").next().unwrap_or_default().to_owned();
                let (group, binding) = (binding.group, binding.binding);
                Some(Binding { group, binding, name: name.into(), kind })
            })
            .collect();
        bindings.sort_by_key(|binding| (binding.group, binding.binding));
        let entry_points: Vec<_> = module
            .entry_points
            .iter()
            .filter_map(|entry| {
                let stage = match entry.stage {
                    naga::ShaderStage::Vertex => Stage::Vertex,
                    naga::ShaderStage::Fragment => Stage::Fragment,
                    naga::ShaderStage::Compute => Stage::Compute,
                    _ => return None,
                };
                let name = entry.name.clone().into();
                Some(EntryPoint { name, stage, workgroup_size: entry.workgroup_size })
            })
            .collect();
        Self { bindings: bindings.into(), entry_points: entry_points.into() }
    }

    /// The bindings of a group.
    pub fn group(&self, group: u32) -> impl Iterator<Item = &Binding> {
        self.bindings.iter().filter(move |binding| binding.group == group)
    }
}

fn kind_of_handle(inner: &TypeInner, is_filtered: bool) -> Option<BindingKind> {
    Some(match *inner {
        TypeInner::Sampler { comparison } => BindingKind::Sampler { compares: comparison },
        TypeInner::AccelerationStructure { .. } => BindingKind::AccelerationStructure,
        TypeInner::Image { dim, arrayed, class } => {
            let dimension = match (dim, arrayed) {
                (ImageDimension::D1, _) => Dimension::D1,
                (ImageDimension::D2, false) => Dimension::D2,
                (ImageDimension::D2, true) => Dimension::D2Array,
                (ImageDimension::Cube, false) => Dimension::Cube,
                (ImageDimension::Cube, true) => Dimension::CubeArray,
                (ImageDimension::D3, _) => Dimension::D3,
            };
            match class {
                ImageClass::Sampled { kind: ScalarKind::Sint, .. } => {
                    BindingKind::Texture { dimension, texels: Texels::Sint }
                }
                ImageClass::Sampled { kind: ScalarKind::Uint, .. } => {
                    BindingKind::Texture { dimension, texels: Texels::Uint }
                }
                ImageClass::Sampled { .. } => BindingKind::Texture {
                    dimension,
                    texels: Texels::Float { filtered: is_filtered },
                },
                ImageClass::Depth { .. } => {
                    BindingKind::Texture { dimension, texels: Texels::Depth }
                }
                ImageClass::Storage { format, access } => BindingKind::StorageTexture {
                    dimension,
                    format: name_of_format(format),
                    access: match (
                        access.contains(StorageAccess::LOAD),
                        access.contains(StorageAccess::STORE),
                    ) {
                        (true, true) => Access::ReadWrite,
                        (true, false) => Access::Read,
                        _ => Access::Write,
                    },
                },
                ImageClass::External => return None,
            }
        }
        _ => return None,
    })
}

/// Formats that baseline WebGPU has for storage, by the names that WGSL gives them.
fn name_of_format(format: naga::StorageFormat) -> &'static str {
    use naga::StorageFormat as F;
    match format {
        F::Rgba8Unorm => "rgba8unorm",
        F::Rgba8Snorm => "rgba8snorm",
        F::Rgba8Uint => "rgba8uint",
        F::Rgba8Sint => "rgba8sint",
        F::Rgba16Uint => "rgba16uint",
        F::Rgba16Sint => "rgba16sint",
        F::Rgba16Float => "rgba16float",
        F::R32Uint => "r32uint",
        F::R32Sint => "r32sint",
        F::R32Float => "r32float",
        F::Rg32Uint => "rg32uint",
        F::Rg32Sint => "rg32sint",
        F::Rg32Float => "rg32float",
        F::Rgba32Uint => "rgba32uint",
        F::Rgba32Sint => "rgba32sint",
        F::Rgba32Float => "rgba32float",
        _ => "none of baseline WebGPU",
    }
}
