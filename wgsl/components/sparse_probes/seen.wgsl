// SPDX-License-Identifier: MIT OR Apache-2.0
//! What a probe sees in a direction: a receiver's number, or one of these.
#define_import_path lucerna::components::sparse_probes::seen

/// The sky.
const SEEN_SKY: u32 = 0xffffffffu;
/// A surface without texels.
const SEEN_UNKNOWN: u32 = 0xfffffffeu;
/// The greatest distance of a map of distances [radii]: also that of the sky.
const MAP_FAR: f32 = 4.0;
