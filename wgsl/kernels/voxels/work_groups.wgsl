// SPDX-License-Identifier: MIT OR Apache-2.0
//! The indirect dispatch for the pieces of work that a scan counted.
//!
//! Dispatch: 1 × 1 × 1. Workgroup memory: none.

#import lucerna::scene::triangles::n_triangles
#import lucerna::math::dispatch::dispatch_of_groups

/// Invocations per workgroup of the dispatch.
const COUNTED_WORKGROUP: u32 = 64u;

/// The first piece of each triangle, and at the end the number of pieces.
@group(1) @binding(0) var<storage, read> work: array<u32>;
/// Workgroups along x, y, z; then the number of pieces.
@group(1) @binding(1) var<storage, read_write> groups: vec4<u32>;

@compute @workgroup_size(1)
fn main() {
    let n = work[n_triangles()];
    let n_groups = n / COUNTED_WORKGROUP + u32(n % COUNTED_WORKGROUP != 0u);
    groups = vec4<u32>(dispatch_of_groups(n_groups), n);
}
