// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a kernel uses, against what baseline WebGPU has.

use naga::{AddressSpace, Handle, ImageClass, Module, StorageAccess, Type, TypeInner};

/// Limits per shader stage and pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// Storage buffers per stage.
    pub storage_buffers: u32,
    /// Of these, how many the scene seam may take.
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
    /// WebGPU's default limits (and the seam's share of the storage buffers).
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

impl Resources {
    /// Counts what the module declares. (A pipeline layout holds what is declared, used or not.)
    pub fn of(module: &Module) -> Self {
        let mut out = Self::default();
        let mut layouter = naga::proc::Layouter::default();
        // A module that did not validate has no layout; then only the sizes are missing.
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

    /// What is over the budget, in words; empty if nothing is.
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

/// What kind of declaration an excess is about, to find its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Counted {
    Buffer,
    /// What the imported seam declares.
    Seam,
    Workgroup,
    Other,
}

/// One limit that is passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excess {
    pub counted: Counted,
    pub message: String,
}
