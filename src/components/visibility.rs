// SPDX-License-Identifier: MIT OR Apache-2.0
//! What tells kernels how much of a light a point sees.

use crate::gpu::{Bindings, OwnedResource};
use crate::shader::{Choice, Variant};

/// Rays, or the maps or voxels that kernels ask instead: what stands behind `lucerna::scene::visibility`.
#[derive(Clone, Debug, Default)]
pub struct LightVisibility {
    choices: Vec<Choice>,
    bindings: Vec<(&'static str, OwnedResource)>,
}

impl LightVisibility {
    /// A ray to each drawn light.
    pub fn rays() -> Self {
        Self::default()
    }

    pub(crate) fn new(choices: &[Choice], bindings: Vec<(&'static str, OwnedResource)>) -> Self {
        Self { choices: choices.to_vec(), bindings }
    }

    /// The variant of kernels that ask this.
    pub fn variant(&self, of_scene: Variant) -> Variant {
        self.choices.iter().fold(of_scene, |variant, &choice| variant.with(choice))
    }

    /// What such kernels bind in group 3.
    pub fn bindings(&self) -> Bindings<'_> {
        self.bindings.iter().map(|(name, resource)| (*name, resource.into())).collect()
    }
}
