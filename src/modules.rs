// SPDX-License-Identifier: MIT OR Apache-2.0
//! The WGSL that lucerna is made of, as data: what a renderer takes into its own frame.

use crate::shader::{
    Access, Binding, BindingKind, Budget, Dimension, EntryPoint, Interface, Library, RAY_QUERY,
    Resources, Source, Stage, Target, Texels, Variant,
};
use std::borrow::Cow;
use std::path::PathBuf;
use std::sync::Arc;

/// A WGSL module that can be imported.
#[derive(Clone, Copy, Debug)]
pub struct Module {
    /// `lucerna::sh::basis`.
    pub import_path: &'static str,
    /// Axis and value in which this module replaces the one of the same path; None: the tree's own.
    pub overlay: Option<(&'static str, &'static str)>,
    /// `wgsl/sh/basis.wgsl`, relative to the crate.
    pub file: &'static str,
    /// The text with its comments, as it stands in the file.
    pub source: &'static str,
    /// Import paths of the modules that it needs directly.
    pub imports: &'static [&'static str],
}

/// A kernel in one of its variants.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Path under `wgsl/kernels/` without ending: `reference/path_trace`.
    pub name: &'static str,
    /// The values of the axes that its imports meet; the first value on all others.
    pub variant: Variant,
    /// Names of the axes that its imports meet.
    pub axes: &'static [&'static str],
    /// The kernel's own file, relative to the crate.
    pub file: &'static str,
    /// The kernel's own text.
    pub source: &'static str,
    /// One self-contained WGSL text: the kernel with everything that it imports (no comments).
    /// None for ray queries, which naga does not write: [`library_of`] composes them.
    pub composed: Option<&'static str>,
    /// Import paths of the modules that it imports directly.
    pub imports: &'static [&'static str],
    /// How much it declares of what WebGPU limits.
    pub resources: Resources,
    /// Its bindings and entry points.
    pub interface: Interface,
}

/// The folder of the WGSL in the crate's sources, for build scripts: `wgsl/sh/basis.wgsl` is `lucerna::sh::basis`, as
/// naga_oil and wgsl_bindgen expect it.
pub const WGSL_DIR: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/wgsl");

const fn variant_of(bytes: [u8; 8]) -> Variant {
    match Variant::from_bytes(bytes) {
        Some(variant) => variant,
        None => panic!("the build knows the axes"),
    }
}

const MODULES: &[Module] = include!(concat!(env!("OUT_DIR"), "/modules.rs"));
static KERNELS: &[Kernel] = include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// Every module: the tree's own sorted by import path, then those that replace one on an axis.
pub fn modules() -> &'static [Module] {
    MODULES
}

/// Every kernel in each of its variants: sorted by name, the baseline first.
pub fn kernels() -> &'static [Kernel] {
    KERNELS
}

/// A kernel as it runs in a variant: what its imports do not meet makes no difference.
///
/// ```
/// use lucerna::shader::{NO_TEXTURES, SHADOW_MAPS, Variant};
///
/// let variant = Variant::BASELINE.with(NO_TEXTURES).with(SHADOW_MAPS);
/// // Copying light asks neither textures nor lights.
/// assert_eq!(lucerna::kernel("voxel_light/carry", variant).unwrap().variant, Variant::BASELINE);
/// assert_eq!(lucerna::kernel("frame/direct", variant).unwrap().variant, variant);
/// ```
pub fn kernel(name: &str, variant: Variant) -> Option<&'static Kernel> {
    KERNELS.iter().find(|kernel| kernel.name == name && kernel.variant.agrees(variant, kernel.axes))
}

/// All modules as a [`Library`], to compose kernels of one's own from them, or with modules of
/// one's own instead of lucerna's.
///
/// ```
/// use lucerna::shader::{Source, Target};
///
/// let kernel = Source {
///     import_path: "my::kernel".into(),
///     file: "my_kernel.wgsl".into(),
///     text: "
///         #import lucerna::math::octahedral::pack_direction
///         @group(1) @binding(0) var<storage, read_write> out: array<u32>;
///         @compute @workgroup_size(64)
///         fn main(@builtin(global_invocation_id) id: vec3<u32>) {
///             out[id.x] = pack_direction(vec3<f32>(0.0, f32(id.x) + 1.0, 1.0));
///         }"
///         .into(),
/// };
/// let composed = lucerna::library().compose(&kernel, Target::default()).unwrap();
/// assert_eq!(composed.interface.entry_points[0].name, "main");
/// ```
pub fn library() -> Library {
    library_of(Variant::BASELINE)
}

/// [`library`] with the modules of a variant's values.
pub fn library_of(variant: Variant) -> Library {
    let mut library = Library::default();
    for module in MODULES.iter().filter(|module| match module.overlay {
        None => true,
        Some((axis, value)) => variant.value_name(axis) == Some(value),
    }) {
        library.insert(Source {
            import_path: module.import_path.to_owned(),
            file: PathBuf::from(module.file),
            text: Cow::Borrowed(module.source),
        });
    }
    library
}

/// Where kernels come from: a variant, and modules of one's own that replace lucerna's or stand beside them.
#[derive(Clone, Debug, Default)]
pub struct Shaders {
    variant: Variant,
    own: Arc<[Source]>,
}

impl Shaders {
    /// lucerna's kernels in a variant.
    pub fn new(variant: Variant) -> Self {
        Self { variant, own: Arc::default() }
    }

    /// The same with another variant.
    pub fn with_variant(&self, variant: Variant) -> Self {
        Self { variant, own: Arc::clone(&self.own) }
    }

    /// The same with a module of one's own: under an import path of the scene seam it replaces lucerna's. A module whose path
    /// begins with `lucerna::kernels::` is a kernel.
    pub fn with_module(&self, module: Source) -> Self {
        let mut own = self.own.to_vec();
        own.retain(|known| known.import_path != module.import_path);
        own.push(module);
        Self { variant: self.variant, own: own.into() }
    }

    /// The values of the axes.
    pub fn variant(&self) -> Variant {
        self.variant
    }

    /// Whether two sources make the same kernels.
    pub fn same(&self, other: &Self) -> bool {
        self.variant == other.variant && self.own == other.own
    }

    /// A kernel's text or IR, and what it binds.
    ///
    /// # Panics
    /// If there is no such kernel, or a module of one's own does not fit: the message holds the problems.
    pub(crate) fn compose(
        &self,
        name: &str,
    ) -> (Cow<'static, str>, Option<naga::Module>, Interface) {
        let row = kernel(name, self.variant);
        let path = format!("lucerna::kernels::{}", name.replace('/', "::"));
        let own_kernel = self.own.iter().find(|source| source.import_path == path);
        if let (Some(Kernel { composed: Some(text), interface, .. }), None, true) =
            (row, own_kernel, self.own.is_empty())
        {
            return (Cow::Borrowed(text), None, interface.clone());
        }
        let source = match (own_kernel, row) {
            (Some(source), _) => source.clone(),
            (None, Some(row)) => Source {
                import_path: path,
                file: PathBuf::from(row.file),
                text: Cow::Borrowed(row.source),
            },
            (None, None) => panic!("there is no kernel `{name}`"),
        };
        let mut library = library_of(self.variant);
        for module in self.own.iter().filter(|module| module.import_path != source.import_path) {
            library.insert(module.clone());
        }
        let budget = (!self.variant.has(RAY_QUERY)).then_some(Budget::BASELINE);
        let target = Target { capabilities: self.variant.capabilities(), budget };
        match library.compose(&source, target) {
            Ok(composed) => (Cow::Borrowed(""), Some(composed.module), composed.interface),
            Err(problems) => {
                let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
                panic!("{name} does not compose:\n{}", problems.join("\n\n"))
            }
        }
    }

    /// A kernel for a device: the build's WGSL, or naga's IR composed now.
    pub(crate) fn module(
        &self,
        gpu: &crate::gpu::Gpu,
        name: &str,
    ) -> (wgpu::ShaderModule, Interface) {
        let (text, module, interface) = self.compose(name);
        let source = match module {
            Some(module) => wgpu::ShaderSource::Naga(Cow::Owned(module)),
            None => wgpu::ShaderSource::Wgsl(text),
        };
        let descriptor = wgpu::ShaderModuleDescriptor { label: Some(name), source };
        (gpu.device.create_shader_module(descriptor), interface)
    }
}
