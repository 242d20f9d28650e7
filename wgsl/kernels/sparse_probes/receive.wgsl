// SPDX-License-Identifier: MIT OR Apache-2.0
//! The indirect irradiance of each receiver, I = U_c l, and its texel in the lightmap.
//!
//! Dispatch: one workgroup for each block of 64 receivers of a cluster, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: 2048
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
    reserved_a: u32,
}

@group(1) @binding(0) var<uniform> info: ReceiveInfo;
@group(1) @binding(1) var<storage, read> clusters: array<Cluster>;
/// x: cluster; y: the block's place in it.
@group(1) @binding(2) var<storage, read> blocks: array<vec2<u32>>;
/// For each block, for each two columns of U_c, a word of two halfs for each of 64 receivers.
@group(1) @binding(3) var<storage, read> reconstruction: array<u32>;
@group(1) @binding(4) var<storage, read> cluster_light: array<vec4<f32>>;
@group(1) @binding(5) var<storage, read> receivers: array<Receiver>;
/// rgb: irradiance of each receiver [W·m⁻²].
@group(1) @binding(6) var<storage, read_write> irradiance: array<vec4<f32>>;
/// rgb: irradiance · scale; a: 1. Layer 0: front, 1: back.
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
    for (var k = local; k < info.n_basis; k += WORKGROUP) {
        light[k] = cluster_light[block.x * info.n_basis + k].rgb;
    }
    workgroupBarrier();
    let own = block.y * WORKGROUP + local;
    if own >= cluster.n_receivers {
        return;
    }
    let n_words = (cluster.n_vectors + 1u) / 2u;
    let first = cluster.first_reconstruction + block.y * n_words * WORKGROUP + local;
    var sum = vec3<f32>(0.0);
    for (var k = 0u; k < n_words; k++) {
        let two = unpack2x16float(reconstruction[first + k * WORKGROUP]);
        sum += two.x * light[2u * k];
        // (The last word's second half is 0, but what it is multiplied by may be anything.)
        if 2u * k + 1u < cluster.n_vectors {
            sum += two.y * light[2u * k + 1u];
        }
    }
    let arrives = max(sum, vec3<f32>(0.0));
    let ix = cluster.first_receiver + own;
    irradiance[ix] = vec4<f32>(arrives, 1.0);
    let texel = min(arrives * info.scale, vec3<f32>(MAX_TEXEL));
    textureStore(lightmap_out, receiver_texel(receivers[ix]), receivers[ix].side, vec4<f32>(texel, 1.0));
}
