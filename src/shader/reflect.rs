// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a composed module declares, read from naga's IR.

use super::budget::{Budget, Resources};
use super::interface::{
    Access, Binding, BindingKind, Dimension, EntryPoint, Interface, Stage, Texels,
};
use naga::valid::ModuleInfo;
use naga::{
    AddressSpace, Handle, ImageClass, ImageDimension, Module, ScalarKind, StorageAccess, Type,
    TypeInner,
};
use std::collections::BTreeSet;

impl Interface {
    /// Reads the interface of a validated module.
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

/// WGSL's names of the storage texture formats of baseline WebGPU.
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

impl Resources {
    /// Counts what the module declares. (A pipeline layout contains all declarations, used or not.)
    pub fn of(module: &Module) -> Self {
        let mut out = Self::default();
        let mut layouter = naga::proc::Layouter::default();
        // A module that did not validate has no layout; in that case only the sizes are missing.
        let laid_out = layouter.update(module.to_ctx()).is_ok();
        for (_, variable) in module.global_variables.iter() {
            match variable.space {
                AddressSpace::Storage { .. } => {
                    out.storage_buffers += 1;
                    if variable.binding.is_some_and(|binding| binding.group == 0) {
                        out.seam_storage_buffers += 1;
                    }
                }
                AddressSpace::Uniform => out.uniform_buffers += 1,
                AddressSpace::WorkGroup if laid_out => {
                    out.workgroup_bytes += layouter[variable.ty].size.next_multiple_of(16);
                }
                AddressSpace::Handle => out.count_handle(module, variable.ty),
                _ => {}
            }
        }
        for entry in &module.entry_points {
            out.workgroup_invocations =
                out.workgroup_invocations.max(entry.workgroup_size.iter().product());
        }
        out
    }

    fn count_handle(&mut self, module: &Module, ty: Handle<Type>) {
        match module.types[ty].inner {
            TypeInner::Image { class: ImageClass::Storage { access, .. }, .. } => {
                self.storage_textures += 1;
                self.texture_atomics |= access.contains(StorageAccess::ATOMIC);
            }
            TypeInner::Image { .. } => self.sampled_textures += 1,
            TypeInner::Sampler { .. } => self.samplers += 1,
            _ => {}
        }
    }

    /// What exceeds the budget, in words; empty if nothing does.
    pub fn excess(&self, budget: &Budget) -> Vec<Excess> {
        let rows = [
            (Counted::Buffer, "storage buffers", self.storage_buffers, budget.storage_buffers),
            (
                Counted::Seam,
                "storage buffers in the scene seam",
                self.seam_storage_buffers,
                budget.seam_storage_buffers,
            ),
            (Counted::Other, "storage textures", self.storage_textures, budget.storage_textures),
            (Counted::Other, "sampled textures", self.sampled_textures, budget.sampled_textures),
            (Counted::Other, "samplers", self.samplers, budget.samplers),
            (Counted::Other, "uniform buffers", self.uniform_buffers, budget.uniform_buffers),
            (
                Counted::Workgroup,
                "invocations per workgroup",
                self.workgroup_invocations,
                budget.workgroup_invocations,
            ),
            (
                Counted::Other,
                "bytes of workgroup memory",
                self.workgroup_bytes,
                budget.workgroup_bytes,
            ),
        ];
        let mut out: Vec<_> = rows
            .into_iter()
            .filter(|&(_, _, used, limit)| used > limit)
            .map(|(counted, what, used, limit)| Excess {
                counted,
                message: match counted {
                    Counted::Seam => format!("{used} {what}; its share is {limit}"),
                    _ => format!("{used} {what}; baseline WebGPU has {limit}"),
                },
            })
            .collect();
        if self.texture_atomics {
            out.push(Excess {
                counted: Counted::Other,
                message: "atomics on a texture; baseline WebGPU has them on storage buffers only"
                    .into(),
            });
        }
        out
    }
}

/// The kind of declaration that exceeds a limit, to find its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    Buffer,
    /// What the imported seam declares.
    Seam,
    Workgroup,
    Other,
}

/// A limit that is exceeded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    pub counted: Counted,
    pub message: String,
}
