// SPDX-License-Identifier: MIT OR Apache-2.0
//! lucerna's WGSL as data, for renderers that use it in their own frame.

#[cfg(feature = "testing")]
pub(crate) mod watch;

use crate::shader::{
    Access, Binding, BindingKind, Dimension, EntryPoint, Interface, Resources, Stage, Texels,
    Variant,
};
#[cfg(feature = "compose")]
use crate::shader::{Library, Source};
use std::borrow::Cow;

/// A WGSL module that can be imported.
#[derive(Clone, Copy, Debug)]
pub struct Module {
    /// `lucerna::sh::basis`.
    pub import_path: &'static str,
    /// Axis and value in which this module replaces the one of the same path; None: the tree's own.
    pub overlay: Option<(&'static str, &'static str)>,
    /// `wgsl/sh/basis.wgsl`, relative to the crate.
    pub file: &'static str,
    /// The text of the file, with its comments.
    pub source: &'static str,
    /// Import paths of the modules that it needs directly.
    pub imports: &'static [&'static str],
}

/// A kernel in one of its variants.
#[derive(Clone, Debug)]
pub struct Kernel {
    /// Path under `wgsl/kernels/` without ending: `reference/path_trace`.
    pub name: &'static str,
    /// The values of the axes that affect its imports; the first value on all others.
    pub variant: Variant,
    /// Names of the axes that affect its imports.
    pub axes: &'static [&'static str],
    /// The kernel's own file, relative to the crate.
    pub file: &'static str,
    /// The kernel's own text.
    pub source: &'static str,
    /// One self-contained WGSL text: the kernel with everything that it imports (no comments). None for ray queries,
    /// which naga cannot write as WGSL: `library_of` composes them.
    pub composed: Option<&'static str>,
    /// Import paths of the modules that it imports directly.
    pub imports: &'static [&'static str],
    /// The limited resources that it declares.
    pub resources: Resources,
    /// Its bindings and entry points.
    pub interface: Interface,
}

/// A folder named `lucerna` with the WGSL as files, for build scripts. `lucerna::sh::basis` is
/// `{WGSL_DIR}/sh/basis.wgsl`, where naga_oil and wgsl_bindgen can find it:
///
/// ```no_run
/// # use wgsl_bindgen::WgslBindgenOptionBuilder;
/// // build.rs, with `lucerna = { version = "…", default-features = false }` under [build-dependencies]
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut options = WgslBindgenOptionBuilder::default();
/// options
///     .workspace_root("shaders")
///     .add_entry_point("shaders/sky.wgsl") // with `#import lucerna::color::srgb::linear_from_srgb`
///     .additional_scan_dir((Some("lucerna"), lucerna::WGSL_DIR))
///     .ir_capabilities(naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32)
///     .output("src/shaders.rs");
/// options.build()?.generate()?;
/// # Ok(())
/// # }
/// ```
pub const WGSL_DIR: &str = concat!(env!("OUT_DIR"), "/lucerna");

/// The text of a file under `wgsl/`. (With the feature `testing` a fault may be planted in it.)
#[cfg(feature = "compose")]
pub(crate) fn text_of(file: &str, text: &'static str) -> Cow<'static, str> {
    #[cfg(feature = "testing")]
    return watch::text_of(file, text);
    #[cfg(not(feature = "testing"))]
    {
        let _ = file;
        Cow::Borrowed(text)
    }
}

const fn variant_of(bytes: [u8; 8]) -> Variant {
    match Variant::from_bytes(bytes) {
        Some(variant) => variant,
        None => panic!("the build knows the axes"),
    }
}

const MODULES: &[Module] = include!(concat!(env!("OUT_DIR"), "/modules.rs"));
static KERNELS: &[Kernel] = include!(concat!(env!("OUT_DIR"), "/kernels.rs"));

/// Every module: the baseline's sorted by import path, then those that replace one on an axis.
pub fn modules() -> &'static [Module] {
    MODULES
}

/// Every kernel in each of its variants, sorted by name, the baseline first.
pub fn kernels() -> &'static [Kernel] {
    KERNELS
}

/// A kernel as it runs in a variant. Axes that do not affect its imports make no difference.
///
/// ```
/// use lucerna::shader::{NO_TEXTURES, SHADOW_MAPS, Variant};
///
/// let variant = Variant::BASELINE.with(NO_TEXTURES).with(SHADOW_MAPS);
/// // Copying light uses neither textures nor lights.
/// assert_eq!(lucerna::kernel("voxel_light/carry", variant).unwrap().variant, Variant::BASELINE);
/// assert_eq!(lucerna::kernel("frame/direct", variant).unwrap().variant, variant);
/// ```
pub fn kernel(name: &str, variant: Variant) -> Option<&'static Kernel> {
    KERNELS.iter().find(|kernel| kernel.name == name && kernel.variant.agrees(variant, kernel.axes))
}

/// All modules as a [`Library`], to compose your own kernels from them, also with your own modules instead of lucerna's
/// (feature `compose`).
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
#[cfg(feature = "compose")]
pub fn library() -> Library {
    library_of(Variant::BASELINE)
}

/// [`library`] with the modules of a variant's values (feature `compose`).
#[cfg(feature = "compose")]
pub fn library_of(variant: Variant) -> Library {
    let mut library = Library::default();
    for module in MODULES.iter().filter(|module| match module.overlay {
        None => true,
        Some((axis, value)) => variant.value_name(axis) == Some(value),
    }) {
        library.insert(Source {
            import_path: module.import_path.to_owned(),
            file: module.file.into(),
            text: text_of(module.file, module.source),
        });
    }
    library
}
