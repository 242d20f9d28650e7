// SPDX-License-Identifier: MIT OR Apache-2.0
//! Composes and checks WGSL. The build script does so, and so does a renderer that replaces parts of the scene seam.
//!
//! * [`Library`]: a set of modules by import path, which follows from a file's path.
//! * [`Library::compose`]: one kernel and everything that it imports, as validated naga IR.
//! * [`check_tree`]: checks a folder of WGSL against every rule of the layers and of the portability budget, and
//!   reports all problems with file, line and column.
//!
//! Composing and checking need the feature `compose`. What kernels declare ([`Interface`], [`Resources`]) and their
//! variants do not need it.
//!
//! This folder is compiled twice, into the crate and into `build.rs`, so it uses nothing else from the crate. The build
//! script composes with any features: it uses all of this folder, and sets `without_compose` for the crate if the
//! feature is off.

mod axes;
mod budget;
#[cfg(not(without_compose))]
mod check;
mod interface;
#[cfg(not(without_compose))]
mod layers;
#[cfg(not(without_compose))]
mod library;
#[cfg(not(without_compose))]
mod problem;
#[cfg(not(without_compose))]
mod reflect;
#[cfg(not(without_compose))]
mod scan;

#[cfg(not(without_compose))]
pub use axes::BASELINE;
pub use axes::{
    AXES, Axis, AxisValue, BASIS_AMBIENT_CUBE, BASIS_CHROMA_CONSTANT, BASIS_CHROMA_SH1, BASIS_SH1,
    BASIS_SH2_BYTES, BASIS_SH2_FLOAT, BASIS_SH4, Choice, NET_PROBES, NO_TEXTURES, RAY_QUERY,
    SHADOW_CONES, SHADOW_MAPS, SURFEL_CONES, UnknownVariant, VOLUME_BUFFERS, Variant,
};
pub use budget::{Budget, Resources};
#[cfg(not(without_compose))]
pub use check::{CheckedKernel, CheckedTree, Overlay, check_tree};
pub use interface::{
    Access, Binding, BindingKind, Dimension, EntryPoint, Interface, Stage, Texels,
};
#[cfg(not(without_compose))]
pub use library::{Composed, Library, Source, Target};
#[cfg(not(without_compose))]
pub use problem::{Problem, Rule};

/// The first segment of import paths.
pub const ROOT: &str = "lucerna";
/// Folder of the kernels, which are never imported.
pub const KERNELS: &str = "kernels";
/// Folder of the overlays that make variants.
pub const OVERLAYS: &str = "variants";
