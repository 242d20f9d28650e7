// SPDX-License-Identifier: MIT OR Apache-2.0
//! The technique `voxel-cone` as a whole: through pixels, against closed forms, the path tracer and itself.

#[path = "../voxel_rt/bias.rs"]
mod bias;
#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
#[allow(dead_code)]
#[path = "../voxel_rt/leaks.rs"]
mod leaks;
#[path = "../voxel_rt/scales.rs"]
mod scales;
#[allow(dead_code)]
#[path = "../voxel_rt/session.rs"]
mod session;
#[path = "../voxel_rt/settling.rs"]
mod settling;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;
#[path = "../voxel_rt/walls.rs"]
mod walls;

mod changes;
mod edges;
mod furnace;
mod glossy;
mod houses;
mod shadows;

use crate::harness::gpu;
use crate::session::Session;
use lucerna::components::voxel_light::Bounces;
use lucerna::components::voxel_pyramid::PyramidStorage;
use lucerna::components::voxels::Resolution;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::Camera;
use lucerna::settings;
use lucerna::techniques::voxel_cone::{Tracing, VoxelCone, VoxelConeSettings};

/// A session of the technique.
fn session(world: &GpuScene, camera: &Camera, settings: VoxelConeSettings) -> Session<VoxelCone> {
    let technique = VoxelCone::new(gpu(), world, settings, camera.position).unwrap();
    Session::of(world, camera, technique)
}

/// So many cells along the longest side.
fn cells(n: u32) -> VoxelConeSettings {
    settings!(VoxelConeSettings { resolution: Resolution::Longest(n), ..Default::default() })
}

/// So many cells along the longest side, and nine cones through prefiltered ones, as in the source.
fn prefiltered(n: u32) -> VoxelConeSettings {
    settings!(VoxelConeSettings {
        tracing: Tracing::Prefiltered,
        n_cones: 9,
        n_bounce_cones: 9,
        ..cells(n)
    })
}

#[test]
fn light_scales() {
    let of = |storage| settings!(VoxelConeSettings { storage, ..prefiltered(16) });
    for settings in [cells(16), of(PyramidStorage::Textures), of(PyramidStorage::Buffers)] {
        scales::indirect_scales_with_the_lights(&move |world, camera| {
            session(world, camera, settings)
        });
    }
}

/// (With one bounce: coarse levels reflect too much of it in a room that has few of their cells, and all bounces take
/// minutes on a CPU.)
#[test]
fn large_scenes() {
    let settings = settings!(VoxelConeSettings { bounces: Bounces::UpTo(1), ..cells(48) });
    scales::a_large_scene_does_not_darken_a_room(
        &move |world, camera| session(world, camera, settings),
        1,
        0.25,
    );
}

#[test]
fn indirect_light_is_as_biased_as_the_page_says() {
    bias::check("voxel-cone.md", [16, 8], &|world, camera, seed| {
        session(world, camera, settings!(VoxelConeSettings { seed, ..cells(24) }))
    });
}

mod that_settles {
    use crate::session::Session;
    use crate::settling::{a_warm_up_ends_when_it_may, what_is_told_arrives};
    use crate::{cells, session};
    use lucerna::gpu_scene::GpuScene;
    use lucerna::scene::Camera;
    use lucerna::settings;
    use lucerna::techniques::voxel_cone::{VoxelCone, VoxelConeSettings};

    fn start(world: &GpuScene, camera: &Camera, seed: u32) -> Session<VoxelCone> {
        session(world, camera, settings!(VoxelConeSettings { seed, ..cells(24) }))
    }

    #[test]
    fn light_to_come() {
        what_is_told_arrives(&start);
    }

    #[test]
    fn warm_up() {
        a_warm_up_ends_when_it_may(&start);
    }
}
