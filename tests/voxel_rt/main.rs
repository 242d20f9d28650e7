//! The technique `voxel-rt` as a whole: through pixels, against closed forms and against itself.

#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;

mod changes;
mod edges;
mod furnace;
mod gather;
mod leaks;
mod session;
