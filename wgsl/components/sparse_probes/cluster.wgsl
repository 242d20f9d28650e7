// SPDX-License-Identifier: MIT OR Apache-2.0
//! A cluster: receivers near each other, whose transport is kept as U_c (Σ_c Vᵀ).
//!
//! P.-P. Sloan, J. Hall, J. Hart, J. Snyder, "Clustered Principal Components for Precomputed Radiance Transfer", SIGGRAPH 2003.
#define_import_path lucerna::components::sparse_probes::cluster

/// 32 bytes.
struct Cluster {
    first_receiver: u32,
    n_receivers: u32,
    /// Its first probe in the list of those of all clusters.
    first_probe: u32,
    n_probes: u32,
    /// Words before its rows of Σ_c Vᵀ.
    first_projection: u32,
    /// Rows of Σ_c Vᵀ: columns of U_c.
    n_vectors: u32,
    /// Words before its columns of U_c.
    first_reconstruction: u32,
    reserved: u32,
}
