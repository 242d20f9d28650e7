// SPDX-License-Identifier: MIT OR Apache-2.0
//! Composing and checking WGSL: what the build script runs, and what a renderer that replaces
//! parts of the scene seam runs itself.
//!
//! * [`Library`]: a set of modules by import path; a file's path is its import path.
//! * [`Library::compose`]: one kernel and everything that it imports, as validated naga IR.
//! * [`check_tree`]: every rule of the layers and of the portability budget over a folder of WGSL,
//!   reporting all problems with file, line and column.
//!
//! Composing and checking need the feature `compose`; what kernels declare ([`Interface`], [`Resources`]) and their variants
//! do not.
//!
//! This folder is compiled twice, into the crate and into `build.rs`, so it uses nothing else of
//! the crate. The build script composes whatever the features are: it has all of this folder, and tells the crate by
//! `without_compose` that the feature is off.

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
    AXES, Axis, AxisValue, Choice, NO_TEXTURES, RAY_QUERY, SHADOW_CONES, SHADOW_MAPS,
    UnknownVariant, VOLUME_BUFFERS, Variant,
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

/// The import path's first segment, and the folder name under which kernels live.
pub const ROOT: &str = "lucerna";
/// Folder of the entry points, never imported.
pub const KERNELS: &str = "kernels";
/// Folder of the overlays that make variants.
pub const OVERLAYS: &str = "variants";
