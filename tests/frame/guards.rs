// SPDX-License-Identifier: MIT OR Apache-2.0
//! No kernel writes behind the end of a buffer, whatever the sizes and counts: those of pictures, grids and scenes that are
//! and are not multiples of workgroups and bricks, with nothing, one, and many of each thing.

use crate::harness::{gpu, submit};
use crate::support::{emitter, floor, lambert, look_down, quad, room, scene, settings};
use crate::whole::accumulated;
use glam::{UVec2, Vec3};
use lucerna::components::LightVisibility;
use lucerna::components::shadow_maps::{ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::components::voxel_light::{Bounces, DirectLight, Levels, RaysInjected, WriteStrategy};
use lucerna::components::voxel_pyramid::PyramidStorage;
use lucerna::components::voxels::{
    RasterMethod, RasterVoxelizer, Resolution, TriangleCounter, Triangles, Voxelizer,
    grid_for_bounds,
};
use lucerna::frame::{DirectPass, DirectSettings, FramePasses, View};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Light, Scene, Sky};
use lucerna::seam::{Change, Revised, Revisions, SceneSeam};
use lucerna::settings as with;
use lucerna::techniques::reference::{Film, PathTracer, UnfinishedPaths, Work};
use lucerna::techniques::voxel_cone::{Specular, Tracing, VoxelCone, VoxelConeSettings};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};
use lucerna::techniques::{NoIndirect, Technique};
use lucerna::testing::{assert_guards, guard_buffers};

/// No triangle, one, and a room with lights of all kinds.
fn worlds() -> Vec<(&'static str, GpuScene)> {
    let one = quad([[0.0; 3], [0.7, 0.1, 0.0], [0.7, 0.1, 0.0], [0.0, 0.3, 0.9]], 0);
    let mut lit =
        scene(room([2.0, 1.0, 3.0], 0), vec![lambert([0.6, 0.5, 0.4]), emitter([4.0; 3])]);
    lit.meshes.push(floor(0.2, 0.5, 1));
    lit.instances.push(lucerna::scene::Instance {
        mesh: 6,
        world_from_object: glam::Affine3A::from_translation(Vec3::ONE),
    });
    for k in 0..3 {
        let position = Vec3::new(0.4 + 0.4 * k as f32, 0.8, 1.3);
        lit.lights.push(Light::Point { position, intensity: Vec3::ONE, range: None });
    }
    lit.lights.push(Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE });
    lit.sky = Sky::Image { width: 5, height: 3, rgb: vec![Vec3::splat(0.3); 15] };
    [
        ("nothing", Scene::default()),
        ("two triangles", scene(vec![one], vec![lambert([0.5; 3])])),
        ("room", lit),
    ]
    .map(|(name, world)| (name, GpuScene::new(gpu(), &world, GpuSceneOptions::default()).unwrap()))
    .into()
}

/// Makes a technique for a scene.
type Make = Box<dyn Fn(&GpuScene) -> Box<dyn Technique>>;

fn techniques() -> Vec<(String, Make)> {
    const EYE: Vec3 = Vec3::new(1.0, 0.5, 1.5);
    let rays = with!(RaysInjected { n_rays: 21, strategy: WriteStrategy::Exact });
    let averaged = with!(RaysInjected { strategy: WriteStrategy::MovingAverage, ..rays });
    let rt = with!(VoxelRtSettings { resolution: 13, points_per_face: 1, ..Default::default() });
    let surfels =
        with!(VoxelConeSettings { resolution: Resolution::Longest(11), ..Default::default() });
    let cone = with!(VoxelConeSettings { tracing: Tracing::Prefiltered, ..surfels });
    let of_rt = |settings: VoxelRtSettings| -> (String, Make) {
        let make = move |world: &GpuScene| -> Box<dyn Technique> {
            Box::new(VoxelRt::new(gpu(), world, settings, EYE).unwrap())
        };
        (format!("{settings:?}"), Box::new(make))
    };
    let of_cone = |settings: VoxelConeSettings| -> (String, Make) {
        let make = move |world: &GpuScene| -> Box<dyn Technique> {
            Box::new(VoxelCone::new(gpu(), world, settings, EYE).unwrap())
        };
        (format!("{settings:?}"), Box::new(make))
    };
    vec![
        of_rt(rt),
        of_rt(with!(VoxelRtSettings { anisotropic: false, bounces: Bounces::UpTo(2), ..rt })),
        of_rt(with!(VoxelRtSettings { levels: Levels::Nested(3), resolution: 12, ..rt })),
        of_rt(with!(VoxelRtSettings { direct: DirectLight::FromLights(rays), ..rt })),
        of_rt(with!(VoxelRtSettings { direct: DirectLight::FromLights(averaged), ..rt })),
        of_rt(with!(VoxelRtSettings { direct: DirectLight::FromCamera(rays), ..rt })),
        of_cone(surfels),
        of_cone(with!(VoxelConeSettings {
            levels: Levels::Nested(2),
            bounces: Bounces::UpTo(2),
            ..surfels
        })),
        of_cone(cone),
        of_cone(with!(VoxelConeSettings {
            anisotropic: false,
            storage: PyramidStorage::Buffers,
            specular: Specular::Fixed(20.0),
            ..cone
        })),
        of_cone(with!(VoxelConeSettings {
            levels: Levels::Nested(2),
            occludes_diffuse: true,
            occludes_specular: true,
            ..cone
        })),
    ]
}

#[test]
fn techniques_stay_within_their_buffers() {
    guard_buffers();
    let camera = look_down(0.8, 1.2);
    for (world_name, world) in worlds() {
        for (name, make) in techniques() {
            let mut technique = make(&world);
            let mut revisions = Revisions::fresh();
            let size = UVec2::new(13, 9);
            let mut passes =
                FramePasses::new(gpu(), &world, size, DirectSettings::default()).unwrap();
            let mut view = View::new(size);
            for frame in 0..3 {
                if frame == 2 {
                    // What is kept is carried over.
                    revisions = revisions.changed(Change::Geometry);
                }
                let world = &Revised { scene: &world, revisions };
                view.advance(world, &camera, &accumulated(3, 0));
                submit(|recorder| passes.record(recorder, world, &view, &mut *technique)).unwrap();
            }
            let n = assert_guards(gpu());
            assert!(n >= 4, "{world_name}, {name}: {n} guarded buffers, expected at least 4");
        }
    }
}

#[test]
fn pictures_stay_within_their_buffers() {
    guard_buffers();
    let camera = look_down(0.8, 1.2);
    for (name, world) in worlds() {
        for size in [UVec2::ONE, UVec2::new(8, 16), UVec2::new(13, 9), UVec2::new(1, 17)] {
            let filtering = ShadowFiltering::Pcf(1.0);
            let shadows = with!(ShadowSettings { resolution: 32, filtering });
            let maps = ShadowMaps::new(gpu(), &world, shadows).unwrap();
            for visibility in [LightVisibility::rays(), maps.visibility()] {
                let direct = DirectSettings::default();
                let mut passes = FramePasses::new(gpu(), &world, size, direct).unwrap();
                passes.direct = DirectPass::new(gpu(), &world, size, direct, &visibility);
                let mut view = View::new(size);
                for _ in 0..2 {
                    view.advance(&world, &camera, &accumulated(2, 0));
                    submit(|recorder| passes.record(recorder, &world, &view, &mut NoIndirect))
                        .unwrap();
                }
            }
            for n_lanes in [1, 3] {
                let film = Film::with_lanes(gpu(), size, n_lanes);
                let rest = UnfinishedPaths::new(gpu(), &film);
                let tracer = PathTracer::new(gpu(), &world);
                let settings = settings(size.x, size.y, 2);
                let work = Work {
                    stripe: 0,
                    first_row: size.y / 3,
                    n_rows: size.y - size.y / 3,
                    first_sample: 0,
                    n_samples: 5,
                    continues: false,
                };
                submit(|recorder| {
                    tracer.record(recorder, &world, &film, &rest, &camera, &settings, work)
                })
                .unwrap();
            }
            let n = assert_guards(gpu());
            assert!(n >= 6, "{name}, {size}: {n} guarded buffers, expected at least 6");
        }
    }
}

#[test]
fn voxelizers_stay_within_their_buffers() {
    guard_buffers();
    for (name, world) in worlds() {
        let facts = world.facts();
        for (resolution, n_faces) in [(1, 1), (4, 6), (7, 1), (18, 6)] {
            let grid = grid_for_bounds(
                facts.bounds_min,
                facts.bounds_max,
                Resolution::Longest(resolution),
                n_faces,
                None,
            );
            let Ok(mut grid) = grid else { continue };
            grid.capacity = grid.size.element_product();
            let counter = TriangleCounter::new(gpu(), &world, grid).unwrap();
            submit(|recorder| counter.record(recorder, &world, Triangles::All).unwrap());
            let voxelizer = Voxelizer::new(gpu(), &world, grid).unwrap();
            submit(|recorder| voxelizer.record(recorder, &world, Triangles::All)).unwrap();
            for method in
                [RasterMethod::ThreeAxes, RasterMethod::DominantAxis, RasterMethod::BoundingQuad]
            {
                let raster = RasterVoxelizer::new(gpu(), &world, grid, method).unwrap();
                submit(|recorder| raster.record(recorder, &world)).unwrap();
            }
            let n = assert_guards(gpu());
            assert!(
                n >= 4,
                "{name}, {resolution} voxels: {n} guarded buffers, expected at least 4"
            );
        }
    }
}
