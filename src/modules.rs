//! The WGSL that lucerna is made of, as data: what a renderer takes into its own frame.

use crate::gpu::Gpu;
use crate::shader::{Library, Resources, Source, variant};
use std::borrow::Cow;
use std::path::PathBuf;

/// A WGSL module that can be imported.
#[derive(Clone, Copy, Debug)]
pub struct Module {
    /// `lucerna::sh::basis`.
    pub import_path: &'static str,
    /// Empty, or the variant in which this module stands in the place of the baseline's.
    pub variant: &'static str,
    /// `wgsl/sh/basis.wgsl`, relative to the crate.
    pub file: &'static str,
    /// The text with its comments, as it stands in the file.
    pub source: &'static str,
    /// Import paths of the modules that it needs directly.
    pub imports: &'static [&'static str],
}

/// A kernel in one of its variants.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// Path under `wgsl/kernels/` without ending: `reference/path_trace`.
    pub name: &'static str,
    /// Empty for the baseline, else a row of [`crate::shader::VARIANTS`].
    pub variant: &'static str,
    /// The kernel's own file, relative to the crate.
    pub file: &'static str,
    /// The kernel's own text.
    pub source: &'static str,
    /// One self-contained WGSL text: the kernel with everything that it imports (no comments).
    /// None for ray queries, which naga does not write: [`variant_library`] composes them.
    pub composed: Option<&'static str>,
    /// Import paths of the modules that it imports directly.
    pub imports: &'static [&'static str],
    /// How much it declares of what WebGPU limits.
    pub resources: Resources,
    /// Its entry points.
    pub entry_points: &'static [EntryPoint],
    /// Its bindings, by group and number.
    pub bindings: &'static [Binding],
}

/// An entry point of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct EntryPoint {
    /// The function's name.
    pub name: &'static str,
    /// `compute`, `vertex` or `fragment`.
    pub stage: &'static str,
    /// Invocations along each axis (zeros where the stage has none).
    pub workgroup_size: [u32; 3],
}

/// A binding of a kernel.
#[derive(Clone, Copy, Debug)]
pub struct Binding {
    /// Bind group; 0 is the host seam's.
    pub group: u32,
    /// Number within the group.
    pub binding: u32,
    /// The variable's name in the source.
    pub name: &'static str,
    /// `uniform buffer`, `storage buffer, read`, `texture`, …
    pub kind: &'static str,
}

const MODULES: &[Module] = include!(concat!(env!("OUT_DIR"), "/modules.rs"));
const KERNELS: &[Kernel] = include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// Every module: the baseline's sorted by import path, then those that variants put in their place.
pub fn modules() -> &'static [Module] {
    MODULES
}

/// Every kernel in each of its variants; the baseline first, sorted by name.
pub fn kernels() -> &'static [Kernel] {
    KERNELS
}

/// All modules as a [`Library`], to compose kernels of one's own from them, or with modules of
/// one's own in the place of lucerna's.
///
/// ```
/// use lucerna::shader::{BASELINE, Source};
///
/// let kernel = Source {
///     import_path: "my::kernel".into(),
///     file: "my_kernel.wgsl".into(),
///     text: "
///         #import lucerna::math::octahedral::pack_direction
///         @group(0) @binding(0) var<storage, read_write> out: array<u32>;
///         @compute @workgroup_size(64)
///         fn main(@builtin(global_invocation_id) id: vec3<u32>) {
///             out[id.x] = pack_direction(vec3<f32>(0.0, f32(id.x) + 1.0, 1.0));
///         }"
///         .into(),
/// };
/// let module = lucerna::library().compose(&kernel, BASELINE).unwrap();
/// assert_eq!(module.entry_points[0].name, "main");
/// ```
pub fn library() -> Library {
    variant_library("")
}

/// [`library`] with a variant's modules in their places; `variant` is a row's name of
/// [`crate::shader::VARIANTS`].
pub fn variant_library(variant: &str) -> Library {
    let mut library = Library::default();
    for module in MODULES.iter().filter(|m| m.variant.is_empty() || m.variant == variant) {
        library.insert(Source {
            import_path: module.import_path.to_owned(),
            file: PathBuf::from(module.file),
            text: Cow::Borrowed(module.source),
        });
    }
    library
}

/// A kernel for a device: the build's WGSL, or for ray queries naga's IR composed now.
pub(crate) fn shader_module(
    gpu: &Gpu,
    name: &'static str,
    variant_name: &'static str,
) -> wgpu::ShaderModule {
    let row = |variant| KERNELS.iter().find(|k| k.name == name && k.variant == variant);
    // A kernel without such a row asks nothing of what the variant replaces, or (`untextured`) only
    // does more than the scene needs: it runs as the baseline.
    let kernel = match row(variant_name) {
        None => row(""),
        found => found,
    };
    let kernel = kernel.expect("kernels are named by the crate itself");
    let source = match kernel.composed {
        Some(wgsl) => wgpu::ShaderSource::Wgsl(wgsl.into()),
        None => {
            let capabilities = variant(variant_name).map(|v| v.capabilities).unwrap_or_default();
            let source = Source {
                import_path: kernel.name.into(),
                file: PathBuf::from(kernel.file),
                text: Cow::Borrowed(kernel.source),
            };
            let module = variant_library(variant_name).compose(&source, capabilities);
            wgpu::ShaderSource::Naga(Cow::Owned(module.expect("the build composed it too")))
        }
    };
    gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some(name), source })
}
