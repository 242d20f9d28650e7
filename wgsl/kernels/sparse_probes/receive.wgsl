// SPDX-License-Identifier: MIT OR Apache-2.0
//! What arrives at each receiver, U_c l, and its texels in the lightmap: irradiance I; and for bakes of radiance, its spherical harmonics R_k, and what they
//! lack of the irradiance, D = I − E(R) (`lucerna::fields::lightmap`).
//!
//! Dispatch: one workgroup for each block of 64 receivers of a cluster and each of its outputs, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 2048
//! bytes. Columns of U_c are stored for 64 receivers side by side, so that a workgroup reads whole lines; l is loaded once. No atomics.

#import lucerna::components::sparse_probes::cluster::Cluster
#import lucerna::components::sparse_probes::receiver::{Receiver, receiver_texel}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;
/// The most numbers of a cluster's light.
const MAX_BASIS: u32 = 128u;
/// The largest number of a texel.
const MAX_TEXEL: f32 = 65504.0;

struct ReceiveInfo {
    n_blocks: u32,
    /// Numbers of each cluster's light, at most MAX_BASIS.
    n_basis: u32,
    /// Irradiance is multiplied by this before it is stored in a texel, a power of two.
    scale: f32,
    /// A NUMBERS_ constant of `sparse_probes/gather`.
    numbers: u32,
    n_receivers: u32,
    reserved_a: u32,
    reserved_b: u32,
    reserved_c: u32,
}

/// As in `sparse_probes/gather`.
const NUMBERS_BYTES: u32 = 1u;

@group(1) @binding(0) var<uniform> info: ReceiveInfo;
@group(1) @binding(1) var<storage, read> clusters: array<Cluster>;
/// x: cluster; y: the block's place in it; those of each output follow each other.
@group(1) @binding(2) var<storage, read> blocks: array<vec2<u32>>;
/// For each block, for each two columns of U_c a word of two halfs for each of 64 receivers, or for each four a word of four bytes (`pack4x8snorm`).
/// 192 more words behind the last block are read, whatever finite numbers they are.
@group(1) @binding(3) var<storage, read> reconstruction: array<u32>;
@group(1) @binding(4) var<storage, read> cluster_light: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read> receivers: array<Receiver>;
/// rgb: what arrives at each receiver, output after output: irradiance [W·m⁻²] (a: 1 if it is known), D [W·m⁻²], R_k [W·sr⁻¹·m⁻²].
@group(1) @binding(6) var<storage, read_write> irradiance: array<vec4<f32>>;
/// rgb: the same · scale; a: 1. Layer 2·output for the front, and the next one for the back.
@group(1) @binding(7) var lightmap_out: texture_storage_2d_array<rgba16float, write>;

var<workgroup> light: array<vec3<f32>, MAX_BASIS>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let block_ix = group_of_dispatch(group);
    // (Uniform over the workgroup.)
    if block_ix >= info.n_blocks {
        return;
    }
    let block = blocks[block_ix];
    let cluster = clusters[block.x];
    for (var k = local; k < MAX_BASIS; k += WORKGROUP) {
        light[k] = select(vec3<f32>(0.0), cluster_light[block.x * info.n_basis + min(k, info.n_basis - 1u)].rgb, k < info.n_basis);
    }
    workgroupBarrier();
    let n_blocks = (cluster.n_receivers + WORKGROUP - 1u) / WORKGROUP;
    let output = block.y / n_blocks;
    let own = block.y % n_blocks * WORKGROUP + local;
    if own >= cluster.n_receivers {
        return;
    }
    let is_bytes = info.numbers == NUMBERS_BYTES;
    let in_word = select(2u, 4u, is_bytes);
    let n_words = (cluster.n_vectors + in_word - 1u) / in_word;
    let first = cluster.first_reconstruction + block.y * n_words * WORKGROUP + local;
    var sum = vec3<f32>(0.0);
    // (Four words are asked for before the first one is used. Beyond the last vector, light is 0.)
    for (var k = 0u; k < n_words; k += 4u) {
        let words = vec4<u32>(
            reconstruction[first + k * WORKGROUP],
            reconstruction[first + (k + 1u) * WORKGROUP],
            reconstruction[first + (k + 2u) * WORKGROUP],
            reconstruction[first + (k + 3u) * WORKGROUP],
        );
        for (var j = 0u; j < 4u; j++) {
            let at = in_word * (k + j);
            if is_bytes {
                let four = unpack4x8snorm(words[j]);
                sum += four.x * light[at] + four.y * light[at + 1u] + four.z * light[at + 2u] + four.w * light[at + 3u];
            } else {
                let two = unpack2x16float(words[j]);
                sum += two.x * light[at] + two.y * light[at + 1u];
            }
        }
    }
    let arrives = select(sum, max(sum, vec3<f32>(0.0)), output == 0u);
    let ix = cluster.first_receiver + own;
    irradiance[output * info.n_receivers + ix] = vec4<f32>(arrives, 1.0);
    let texel = clamp(arrives * info.scale, vec3<f32>(-MAX_TEXEL), vec3<f32>(MAX_TEXEL));
    textureStore(lightmap_out, receiver_texel(receivers[ix]), 2u * output + receivers[ix].side, vec4<f32>(texel, 1.0));
}
