// SPDX-License-Identifier: MIT OR Apache-2.0
//! Whether each of many rays hits anything.
//!
//! Dispatch: ceil(n/64) × 1 × 1. Workgroup memory: none.

#import lucerna::scene::rays::any_hit
#import lucerna::scene::types::Ray
#import lucerna::math::loops::loops_run

const WORKGROUP: u32 = 64u;
/// The ray takes more steps than the driver allows in a loop (`math::loops`).
const ANY_HIT_UNKNOWN: u32 = 2u;

struct BatchInfo {
    n_rays: u32,
    /// First ray of this dispatch.
    first: u32,
}

@group(1) @binding(0) var<uniform> batch: BatchInfo;
@group(1) @binding(1) var<storage, read> rays: array<Ray>;
/// 1: the ray is blocked; 0: it is not; ANY_HIT_UNKNOWN.
@group(1) @binding(2) var<storage, read_write> blocked: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let ix = batch.first + id.x;
    if ix >= batch.n_rays {
        return;
    }
    let is_blocked = any_hit(rays[ix]);
    // (No dispatch starts beyond ray 2³¹.)
    blocked[ix] = select(ANY_HIT_UNKNOWN, u32(is_blocked), loops_run(batch.first >> 31u));
}
