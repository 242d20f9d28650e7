// SPDX-License-Identifier: MIT OR Apache-2.0
//! The technique `voxel-rt` as a whole: through pixels, against closed forms and against itself.

#[allow(dead_code)]
#[path = "../kernels/harness.rs"]
mod harness;
#[allow(dead_code)]
#[path = "../reference/support.rs"]
mod support;

mod bias;
mod changes;
mod edges;
mod furnace;
mod gather;
mod houses;
mod leaks;
mod scales;
mod session;
mod settling;
mod walls;

mod of_any_size {
    use crate::scales::{a_large_scene_does_not_darken_a_room, indirect_scales_with_the_lights};
    use crate::session::{Session, camera, lit_room, upload};
    use lucerna::components::voxel_light::{DirectLight, Levels, RaysInjected, WriteStrategy};
    use lucerna::settings;
    use lucerna::techniques::voxel_rt::VoxelRtSettings;

    fn coarse() -> VoxelRtSettings {
        settings!(VoxelRtSettings { resolution: 16, points_per_face: 2, ..Default::default() })
    }

    #[test]
    fn light_scales() {
        let injected = |strategy| {
            let rays = lucerna::settings!(RaysInjected { n_rays: 64, strategy });
            settings!(VoxelRtSettings { direct: DirectLight::FromLights(rays), ..coarse() })
        };
        for settings in
            [coarse(), injected(WriteStrategy::Exact), injected(WriteStrategy::MovingAverage)]
        {
            println!("{:?}", settings.direct);
            indirect_scales_with_the_lights(&move |world, camera| {
                Session::new(world, camera, settings)
            });
        }
    }

    #[test]
    fn large_scenes() {
        let settings =
            settings!(VoxelRtSettings { resolution: 24, points_per_face: 4, ..Default::default() });
        a_large_scene_does_not_darken_a_room(
            &move |world, camera| Session::new(world, camera, settings),
            32,
            0.1,
        );
    }

    /// One level is not fine enough beside a large ground, and says so.
    #[test]
    fn coarse_cells_are_told() {
        let mut world = lit_room();
        let eye = camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4]);
        let reach = |world: &_, levels| {
            let settings =
                settings!(VoxelRtSettings { levels, resolution: 64, ..Default::default() });
            let session = Session::new(&upload(world), &eye, settings);
            (*session.technique.reach(), session.technique.light().n_levels())
        };
        let (alone, n) = reach(&world, Levels::Auto);
        assert!(
            n == 1 && !alone.is_coarse() && !alone.is_cut,
            "a room alone has {n} levels, expected 1 that is neither coarse nor cut: {alone:?}"
        );
        world.meshes.push(crate::support::floor(1000.0, -0.01, 0));
        let world_from_object = glam::Affine3A::IDENTITY;
        world
            .instances
            .push(lucerna::scene::Instance { mesh: world.meshes.len() - 1, world_from_object });
        let (one, _) = reach(&world, Levels::Nested(1));
        assert!(
            one.is_coarse() && one.finest_cell > 30.0,
            "one level beside a large ground, expected coarse cells above 30 m: {one:?}"
        );
        let (auto, n) = reach(&world, Levels::Auto);
        assert!(
            !auto.is_coarse() && n == 4 && auto.coarsest_cell == one.finest_cell,
            "levels of a room beside a large ground are {n}, expected 4 that are not coarse, the coarsest cell {}: {auto:?}",
            one.finest_cell
        );
    }
}

#[test]
fn indirect_light_is_as_biased_as_the_page_says() {
    use crate::session::Session;
    use lucerna::settings;
    use lucerna::techniques::voxel_rt::VoxelRtSettings;
    bias::check("voxel-rt.md", [48, 16], &|world, camera, seed| {
        let settings = settings!(VoxelRtSettings { resolution: 32, seed, ..Default::default() });
        Session::new(world, camera, settings)
    });
}

mod that_settles {
    use crate::session::Session;
    use crate::settling::{a_warm_up_ends_when_it_may, what_is_told_arrives};
    use lucerna::gpu_scene::GpuScene;
    use lucerna::scene::Camera;
    use lucerna::settings;
    use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};

    fn start(world: &GpuScene, camera: &Camera, seed: u32) -> Session<VoxelRt> {
        let settings = settings!(VoxelRtSettings { resolution: 32, seed, ..Default::default() });
        Session::new(world, camera, settings)
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
