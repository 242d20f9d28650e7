// SPDX-License-Identifier: MIT OR Apache-2.0
//! The nearest hit of each of many rays.
//!
//! Dispatch: ceil(n/64) × 1 × 1. Workgroup memory: none.

#import lucerna::scene::rays::nearest_hit
#import lucerna::scene::types::{Ray, Hit}
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 64u;
/// `triangle` of a ray that takes more steps than the driver allows in a loop (`math::loops`).
const NEAREST_HIT_UNKNOWN: u32 = 0xfffffffeu;

struct BatchInfo {
    n_rays: u32,
    /// First ray of this dispatch.
    first: u32,
}

@group(1) @binding(0) var<uniform> batch: BatchInfo;
@group(1) @binding(1) var<storage, read> rays: array<Ray>;
@group(1) @binding(2) var<storage, read_write> hits: array<Hit>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let ix = batch.first + id.x;
    if ix >= batch.n_rays {
        return;
    }
    var hit = nearest_hit(rays[ix]);
    // (No dispatch starts beyond ray 2³¹.)
    if !loops_run(batch.first >> 31u) {
        hit.triangle = NEAREST_HIT_UNKNOWN;
    }
    hits[ix] = hit;
}
