// SPDX-License-Identifier: MIT OR Apache-2.0
//! The light of each cluster in its own basis: l = (Σ_c Vᵀ) λ, over those probes alone that count in the cluster.
//!
//! Dispatch: one workgroup for each cluster, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 8192 bytes. Eight invocations
//! share a row, so that they read 32 bytes of it at once; λ is loaded once for all rows. No atomics.

#import lucerna::components::sparse_probes::cluster::Cluster
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 256u;
/// Invocations that share a row.
const SHARE: u32 = 8u;
const ROWS: u32 = WORKGROUP / SHARE;
/// Columns that are staged at once; an even number.
const TILE: u32 = 256u;

struct ClustersInfo {
    n_clusters: u32,
    /// Of each probe, at most 64.
    n_coefficients: u32,
    /// Numbers of each cluster's light.
    n_basis: u32,
    /// A NUMBERS_ constant.
    numbers: u32,
}

/// How numbers are stored: two halfs a word (`pack2x16float`); or four of eight bits (`pack4x8snorm`).
const NUMBERS_HALFS: u32 = 0u;
const NUMBERS_BYTES: u32 = 1u;

@group(1) @binding(0) var<uniform> info: ClustersInfo;
@group(1) @binding(1) var<storage, read> clusters: array<Cluster>;
/// The numbers of the probes of all clusters.
@group(1) @binding(2) var<storage, read> cluster_probes: array<u32>;
/// Rows of Σ_c Vᵀ, each a number of whole words. Before a row of bytes there is what they are multiplied by [f32]. 24 more words behind the last row are read, whatever finite numbers they are.
@group(1) @binding(3) var<storage, read> projection: array<u32>;
/// rgb: coefficients of the probes.
@group(1) @binding(4) var<storage, read> lambda: array<vec4<f32>>;
/// rgb: for each cluster, `n_basis` numbers.
@group(1) @binding(5) var<storage, read_write> cluster_light: array<vec4<f32>>;

var<workgroup> staged: array<vec3<f32>, TILE>;
var<workgroup> parts: array<vec3<f32>, WORKGROUP>;

const_assert TILE / 4u >= 2u * 4u * SHARE;

/// A word's numbers times what is staged from `first` on.
fn word_product(word: u32, first: u32, is_bytes: bool) -> vec3<f32> {
    if is_bytes {
        let four = unpack4x8snorm(word);
        return four.x * staged[first] + four.y * staged[first + 1u] + four.z * staged[first + 2u] + four.w * staged[first + 3u];
    }
    let two = unpack2x16float(word);
    return two.x * staged[first] + two.y * staged[first + 1u];
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if ix >= info.n_clusters {
        return;
    }
    let cluster = clusters[ix];
    let n = info.n_coefficients;
    let n_columns = cluster.n_probes * n;
    let is_bytes = info.numbers == NUMBERS_BYTES;
    let in_word = select(2u, 4u, is_bytes);
    let words_of_row = (n_columns + in_word - 1u) / in_word + u32(is_bytes);
    let lane = local % SHARE;
    for (var first_row = 0u; first_row < info.n_basis; first_row += ROWS) {
        let row = first_row + local / SHARE;
        var sum = vec3<f32>(0.0);
        for (var first = 0u; first < n_columns; first += TILE) {
            let column = first + local;
            var value = vec3<f32>(0.0);
            if column < n_columns {
                let probe = cluster_probes[cluster.first_probe + column / n];
                value = lambda[probe * n + column % n].rgb;
            }
            staged[local] = value;
            workgroupBarrier();
            if row < cluster.n_vectors {
                let start = cluster.first_projection + row * words_of_row + first / in_word + u32(is_bytes);
                let n_words = (min(TILE, n_columns - first) + in_word - 1u) / in_word;
                // (Four words are asked for before the first one is used. What is behind the row's end is multiplied by staged zeros.)
                for (var k = lane; k < n_words; k += 4u * SHARE) {
                    let words = vec4<u32>(
                        projection[start + k],
                        projection[start + k + SHARE],
                        projection[start + k + 2u * SHARE],
                        projection[start + k + 3u * SHARE],
                    );
                    for (var j = 0u; j < 4u; j++) {
                        sum += word_product(words[j], in_word * (k + j * SHARE), is_bytes);
                    }
                }
            }
            workgroupBarrier();
        }
        parts[local] = sum;
        workgroupBarrier();
        if lane == 0u && row < info.n_basis {
            for (var k = 1u; k < SHARE; k++) {
                sum += parts[local + k];
            }
            if is_bytes && row < cluster.n_vectors {
                sum *= bitcast<f32>(projection[cluster.first_projection + row * words_of_row]);
            }
            cluster_light[ix * info.n_basis + row] = vec4<f32>(sum, 0.0);
        }
        workgroupBarrier();
    }
}
