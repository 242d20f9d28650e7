// SPDX-License-Identifier: MIT OR Apache-2.0
//! How kernels find out how much of a light a point sees.

use crate::gpu::{Bindings, OwnedResource};
use crate::shader::{Choice, Variant};

/// The implementation behind `lucerna::scene::visibility`: rays, or shadow maps or voxels instead.
#[derive(Clone, Debug, Default)]
pub struct LightVisibility {
    choices: Vec<Choice>,
    bindings: Vec<(&'static str, OwnedResource)>,
}

impl LightVisibility {
    /// A ray to each sampled light.
    pub fn rays() -> Self {
        Self::default()
    }

    /// Another implementation: what it chooses on the axes, and the resources of group 3 that it needs, by the names of
    /// their variables.
    pub fn new(choices: &[Choice], bindings: Vec<(&'static str, OwnedResource)>) -> Self {
        Self { choices: choices.to_vec(), bindings }
    }

    /// The variant of kernels that use this.
    pub fn variant(&self, of_scene: Variant) -> Variant {
        self.choices.iter().fold(of_scene, |variant, &choice| variant.with(choice))
    }

    /// The bindings of such kernels in group 3.
    pub fn bindings(&self) -> Bindings<'_> {
        self.bindings.iter().map(|(name, resource)| (*name, resource.into())).collect()
    }
}
