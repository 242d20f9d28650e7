// SPDX-License-Identifier: MIT OR Apache-2.0
//! Long one-dimensional dispatches, laid out in two dimensions.
//!
//! WebGPU dispatches at most 65 535 workgroups along an axis. Long work is laid out in rows of
//! DISPATCH_ROW workgroups; the row's length is fixed, so that a kernel need not know how many were
//! dispatched, even indirectly.
#define_import_path lucerna::math::dispatch

/// Workgroups of a full row: a power of two below the limit.
const DISPATCH_ROW: u32 = 32768u;

/// The dispatch of `n_groups` workgroups (at most 2³⁰); up to DISPATCH_ROW − 1 more may run.
fn dispatch_of_groups(n_groups: u32) -> vec3<u32> {
    let rows = n_groups / DISPATCH_ROW + u32(n_groups % DISPATCH_ROW != 0u);
    return vec3<u32>(min(n_groups, DISPATCH_ROW), rows, 1u);
}

/// Index of this workgroup among those of [`dispatch_of_groups`].
fn group_of_dispatch(workgroup_id: vec3<u32>) -> u32 {
    return workgroup_id.y * DISPATCH_ROW + workgroup_id.x;
}
