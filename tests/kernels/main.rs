// SPDX-License-Identifier: MIT OR Apache-2.0
//! Every WGSL module and kernel against oracles in f64.

mod bsdf;
mod color;
mod cone;
mod convergence;
mod geometry;
mod harness;
mod light;
mod math;
mod next_event;
mod picture;

mod pixels;
mod probe_light;
mod probe_masks;
mod probe_net;
mod probes;
mod rays;
mod sampling;
mod scan;
mod seam;
mod sh;
mod shadow_maps;
mod sparse_probes;
mod statistics;
mod texture;
mod texture_oracle;
mod view;
mod voxel;
mod voxel_attributes;
mod voxel_cache;
mod voxel_faces;
mod voxel_parts;
mod voxel_pixels;
mod voxel_sides;
mod voxel_surfels;
mod voxel_write;
mod voxelize;
