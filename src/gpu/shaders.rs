// SPDX-License-Identifier: MIT OR Apache-2.0
//! The source of kernels.

use super::Gpu;
use crate::modules::kernel;
#[cfg(feature = "testing")]
use crate::modules::watch;
use crate::shader::{Interface, Variant};
use std::borrow::Cow;

#[cfg(feature = "compose")]
use crate::shader::{Budget, Composed, Problem, RAY_QUERY, Source, Target};

/// The source of kernels: a variant, and (feature `compose`) your own modules, which replace lucerna's or are added to
/// them.
#[derive(Clone, Debug, Default)]
pub struct Shaders {
    variant: Variant,
    #[cfg(feature = "compose")]
    own: std::sync::Arc<[Source]>,
}

impl Shaders {
    /// lucerna's kernels in this variant.
    pub fn new(variant: Variant) -> Self {
        Self::default().with_variant(variant)
    }

    /// The same with another variant.
    pub fn with_variant(&self, variant: Variant) -> Self {
        let mut out = self.clone();
        out.variant = variant;
        out
    }

    /// The values of the axes.
    pub fn variant(&self) -> Variant {
        self.variant
    }

    /// A kernel for a device: WGSL composed at build time, or naga's IR composed now.
    ///
    /// # Panics
    /// If there is no such kernel, if it has to be composed and the feature `compose` is off, or if one of your own
    /// modules does not compose. The message has the problems.
    pub(crate) fn module(&self, gpu: &Gpu, name: &str) -> (wgpu::ShaderModule, Interface) {
        let (source, interface) = self.source(name);
        let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source };
        (gpu.device.create_shader_module(descriptor), interface)
    }
}

#[cfg(not(feature = "compose"))]
impl Shaders {
    /// Whether two sources make the same kernels.
    pub fn same(&self, other: &Self) -> bool {
        self.variant == other.variant
    }

    /// A kernel's text or IR, and what it binds. Panics as [`Self::module`] does.
    pub(super) fn source(&self, name: &str) -> (wgpu::ShaderSource<'static>, Interface) {
        let variant = self.variant;
        let Some(row) = kernel(name, variant) else { panic!("there is no kernel `{name}`") };
        let Some(text) = row.composed else {
            panic!(
                "{name} in the variant {variant} must be composed at run time: enable lucerna's feature `compose`"
            )
        };
        (wgpu::ShaderSource::Wgsl(Cow::Borrowed(text)), row.interface.clone())
    }
}

#[cfg(feature = "compose")]
impl Shaders {
    /// Adds your own module. (Pipelines are made from it later: [`Self::check`] says what is wrong with it now.) If it has the import path of one of lucerna's modules, such as those of the scene seam, it
    /// replaces that module. A module whose path begins with `lucerna::kernels::` is a kernel.
    pub fn with_module(&self, module: Source) -> Self {
        let mut own = self.own.to_vec();
        own.retain(|known| known.import_path != module.import_path);
        own.push(module);
        Self { variant: self.variant, own: own.into() }
    }

    /// Composes these kernels as pipelines will, so that a mistake in your own modules can be told before anything is
    /// made: constructors that compile kernels panic if one does not compose.
    ///
    /// # Errors
    /// All problems of the first kernel that does not compose.
    ///
    /// # Panics
    /// If there is no kernel of one of these names.
    pub fn check(&self, kernels: &[&str]) -> Result<(), Vec<Problem>> {
        kernels.iter().try_for_each(|name| self.composed(name).map(|_| ()))
    }

    /// Whether two sources make the same kernels.
    pub fn same(&self, other: &Self) -> bool {
        self.variant == other.variant && self.own == other.own
    }

    /// A kernel's text or IR, and what it binds. Panics as [`Self::module`] does.
    pub(super) fn source(&self, name: &str) -> (wgpu::ShaderSource<'static>, Interface) {
        #[cfg(feature = "testing")]
        let is_built = self.own.is_empty() && !watch::is_on();
        #[cfg(not(feature = "testing"))]
        let is_built = self.own.is_empty();
        if let (true, Some(row)) = (is_built, kernel(name, self.variant))
            && let Some(text) = row.composed
        {
            return (wgpu::ShaderSource::Wgsl(Cow::Borrowed(text)), row.interface.clone());
        }
        match self.composed(name) {
            Ok(composed) => {
                (wgpu::ShaderSource::Naga(Cow::Owned(composed.module)), composed.interface)
            }
            Err(problems) => {
                let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
                panic!("{name} does not compose:\n{}", problems.join("\n\n"))
            }
        }
    }

    /// A kernel, composed now. Panics if there is none of this name.
    fn composed(&self, name: &str) -> Result<Composed, Vec<Problem>> {
        let path = format!("lucerna::kernels::{}", name.replace('/', "::"));
        let own_kernel = self.own.iter().find(|source| source.import_path == path);
        let source = match (own_kernel, kernel(name, self.variant)) {
            (Some(source), _) => source.clone(),
            (None, Some(row)) => {
                let text = crate::modules::text_of(row.file, row.source);
                Source { import_path: path, file: row.file.into(), text }
            }
            (None, None) => panic!("there is no kernel `{name}`"),
        };
        let mut library = crate::library_of(self.variant);
        for module in self.own.iter().filter(|module| module.import_path != source.import_path) {
            library.insert(module.clone());
        }
        #[cfg(feature = "testing")]
        if let Ok(dependencies) = library.dependencies(&source) {
            let files = dependencies.iter().copied().chain([&source]);
            watch::trace(files.map(|of| of.file.display().to_string()));
        }
        let budget = (!self.variant.has(RAY_QUERY)).then_some(Budget::BASELINE);
        library.compose(&source, Target { capabilities: self.variant.capabilities(), budget })
    }
}
