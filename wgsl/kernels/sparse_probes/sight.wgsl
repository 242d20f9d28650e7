// SPDX-License-Identifier: MIT OR Apache-2.0
//! Which probes see each receiver, as bits: at the point that stands for it.
//!
//! Dispatch: one invocation for each word of 32 probes of each receiver, in rows as `lucerna::math::dispatch` lays them out. Workgroup memory: none.

#import lucerna::components::sparse_probes::receiver::Receiver
#import lucerna::integrators::probe_sight::{probe_sees_surface, sided_surface}
#import lucerna::math::dispatch::group_of_dispatch

const WORKGROUP: u32 = 64u;

struct SightInfo {
    /// The first word of this dispatch, and how many there are in all.
    first: u32,
    n_words: u32,
    n_probes: u32,
    /// Words of each receiver.
    n_words_each: u32,
}

@group(1) @binding(0) var<uniform> info: SightInfo;
@group(1) @binding(1) var<storage, read> receivers: array<Receiver>;
/// xyz: probes [m].
@group(1) @binding(2) var<storage, read> places: array<vec4<f32>>;
/// Bit p % 32 of word p / 32 of a receiver: probe p sees it.
@group(1) @binding(3) var<storage, read_write> sight: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let ix = info.first + group_of_dispatch(group) * WORKGROUP + local;
    if ix >= info.n_words {
        return;
    }
    let receiver = receivers[ix / info.n_words_each];
    let surface = sided_surface(receiver.triangle, unpack2x16unorm(receiver.weights), receiver.side);
    let first = 32u * (ix % info.n_words_each);
    var bits = 0u;
    for (var k = 0u; k < min(32u, info.n_probes - first); k++) {
        if probe_sees_surface(places[first + k].xyz, surface) {
            bits |= 1u << k;
        }
    }
    sight[ix] = bits;
}
