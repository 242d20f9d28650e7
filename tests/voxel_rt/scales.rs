// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lights of any strength, and rooms that are small beside their scene. Shared with `voxel-cone`'s tests.

use crate::harness::gpu;
use crate::session::{Session, camera, lit_room, upload};
use crate::support::{emitter, floor, quad};
use glam::Vec3;
use lucerna::blocking::render_reference;
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Instance, Light, Scene};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, resolve};

/// Makes a session of a technique.
pub type Make<T> = dyn Fn(&GpuScene, &Camera) -> Session<T>;

fn eye() -> Camera {
    camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4])
}

/// Mean indirect light of a few frames.
fn indirect<T: Technique>(world: &Scene, make: &Make<T>) -> f64 {
    let world = upload(world);
    let mut session = make(&world, &eye());
    session.run(&world, 24);
    session.mean(&world, 8, Channel::Indirect).element_sum()
}

/// k times the light is k times the picture, within 1 %, for lamps and points of light.
pub fn indirect_scales_with_the_lights<T: Technique>(make: &Make<T>) {
    let lit = |k: f32| {
        let mut world = lit_room();
        let Some(Light::Point { intensity, .. }) = world.lights.last_mut() else {
            panic!("a point light")
        };
        *intensity *= k;
        world.materials.push(emitter((Vec3::new(3.0, 2.0, 1.0) * k).into()));
        let lamp = [[0.4, 0.9, 1.6], [0.6, 0.9, 1.6], [0.6, 0.9, 1.9], [0.4, 0.9, 1.9]];
        add(&mut world, quad(lamp, 1));
        indirect(&world, make)
    };
    let one = lit(1.0);
    assert!(one > 0.0, "mean indirect light of lamp and point light is {one}, expected above 0");
    for k in [1e-6f32, 1e-3, 1e6] {
        let ratio = lit(k) / f64::from(k) / one;
        println!("{k:e} times the light: {ratio:.5}");
        assert!(
            (ratio - 1.0).abs() <= 0.01,
            "{k:e} times the light: mean indirect light is {ratio} times as much per unit, expected 1 within 0.01"
        );
    }
}

fn add(world: &mut Scene, mesh: lucerna::scene::Mesh) {
    let world_from_object = glam::Affine3A::IDENTITY;
    world.instances.push(Instance { mesh: world.meshes.len(), world_from_object });
    world.meshes.push(mesh);
}

/// A room beside a ground of 1 km, inside a dome of 1 km, or with a stray triangle 10⁶ m away has its light all the same.
///
/// Within `tolerance` of the path tracer's of as many bounces, which sees the room alone.
pub fn a_large_scene_does_not_darken_a_room<T: Technique>(
    make: &Make<T>,
    n_bounces: u32,
    tolerance: f64,
) {
    let truth = {
        let settings = settings!(lucerna::techniques::reference::ReferenceSettings {
            size: glam::UVec2::splat(crate::session::SIDE),
            n_bounces,
            seed: 0,
            irradiance: false,
            occlusion_distance: 0.0,
        });
        let world = upload(&lit_room());
        let (sums, _) = render_reference(gpu(), &world, &eye(), &settings, 64, |_| true).unwrap();
        let picture = resolve(&sums, settings.size, Channel::Indirect).rgb;
        picture.iter().map(|rgb| rgb.as_dvec3().element_sum()).sum::<f64>() / picture.len() as f64
    };
    println!("alone: {:.4}", indirect(&lit_room(), make) / truth);
    let stray = |at: f32| quad([[at, 0.0, 0.0], [at, 1.0, 0.0], [at, 1.0, 1.0], [at, 0.0, 1.0]], 0);
    let beside: [(&str, Vec<lucerna::scene::Mesh>); 3] = [
        ("ground", vec![floor(1000.0, -0.01, 0)]),
        ("dome", [floor(1000.0, -50.0, 0), floor(1000.0, 900.0, 0)].into()),
        ("stray", vec![stray(1e6)]),
    ];
    for (what, meshes) in beside {
        let mut world = lit_room();
        meshes.into_iter().for_each(|mesh| add(&mut world, mesh));
        let ratio = indirect(&world, make) / truth;
        println!("{what}: {ratio:.4}");
        assert!(
            (ratio - 1.0).abs() <= tolerance,
            "{what}: mean indirect light of the room is {ratio} of the path tracer's, expected 1 within {tolerance}"
        );
    }
}
