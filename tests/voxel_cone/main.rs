//! The technique `voxel-cone` as a whole: through pixels, against closed forms, the path tracer and itself.

#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
#[allow(dead_code)]
#[path = "../voxel_rt/leaks.rs"]
mod leaks;
#[allow(dead_code)]
#[path = "../voxel_rt/session.rs"]
mod session;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;

mod changes;
mod edges;
mod furnace;
mod glossy;
mod shadows;

use crate::harness::gpu;
use crate::session::Session;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::Camera;
use lucerna::voxel::Resolution;
use lucerna::voxel_cone::{VoxelCone, VoxelConeSettings};

/// A session of the technique.
fn session(world: &GpuScene, camera: &Camera, settings: VoxelConeSettings) -> Session<VoxelCone> {
    let technique = VoxelCone::new(gpu(), world, settings, camera.position).unwrap();
    Session::of(world, camera, technique)
}

/// So many cells along the longest side.
fn cells(n: u32) -> VoxelConeSettings {
    VoxelConeSettings { resolution: Resolution::Longest(n), ..Default::default() }
}
