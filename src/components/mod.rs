// SPDX-License-Identifier: MIT OR Apache-2.0
//! The parts from which techniques are built. A component keeps data on the GPU, updates it, and offers it to kernels,
//! which look it up (`wgsl/fields/`).
//!
//! | component | keeps |
//! |---|---|
//! | [`voxels`] | which cells of a grid surfaces intersect, and what they look like there |
//! | [`voxel_light`] | irradiance of the voxels' faces, in nested grids around the eye |
//! | [`voxel_surfels`] | where in their cells the surfaces are that faces see, for rays from one to the next |
//! | [`voxel_pyramid`] | light and opacity of ever coarser voxels, for cones |
//! | [`probes`] | light that arrives at the corners of cells with surfaces, and how far one sees from there |
//! | `lightmap` (feature `bake`) | texture coordinates of all surfaces, and the points that texels stand for |
//! | [`shadow_maps`] | what lights see |
//! | `sparse_probes` (feature `bake`) | a lightmap of indirect light, from few probes and precomputed transport |
//! | [`convergence`] | how much light that is gathered over frames still changes |

pub mod convergence;
#[cfg(feature = "bake")]
pub mod lightmap;
#[cfg(feature = "nets")]
pub mod probe_net;
pub mod probes;
pub mod shadow_maps;
// (Without nets, nothing places probes, and bakes are only used.)
#[cfg(feature = "bake")]
#[cfg_attr(not(feature = "nets"), allow(dead_code, unused_imports))]
pub mod sparse_probes;
pub mod voxel_light;
pub mod voxel_pyramid;
pub mod voxel_surfels;
pub mod voxels;

mod visibility;

pub use visibility::LightVisibility;
