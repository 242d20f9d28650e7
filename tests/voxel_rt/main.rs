//! The technique `voxel-rt` as a whole: against closed forms, the reference, and itself.

#[path = "../kernels/harness.rs"]
#[allow(dead_code, reason = "each group of tests uses a part of it")]
mod harness;
#[path = "../reference/support.rs"]
#[allow(dead_code, reason = "each group of tests uses a part of it")]
mod support;

mod furnace;
