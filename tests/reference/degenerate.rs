// SPDX-License-Identifier: MIT OR Apache-2.0
//! Meshes that are legal and unusual.

use crate::harness::{Largest, gpu};
use crate::support::{diffuse, lambert, look_down, quad, scene, settings};
use glam::Vec3;
use lucerna::blocking::render_reference;
use lucerna::scene::{Mesh, Sky};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};

/// A square floor of this half side.
fn square(half: f32) -> Mesh {
    quad([[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]], 0)
}

/// A floor is as light as one of it, however often it lies there, and whatever smaller ones lie in it.
#[test]
fn coincident_and_concentric_triangles_are_as_light_as_one() {
    let irradiance = |meshes: Vec<Mesh>| {
        let mut world = scene(meshes, vec![lambert([0.5; 3])]);
        world.sky = Sky::Constant(Vec3::ONE);
        let world = diffuse(&world);
        let settings = settings!(ReferenceSettings { irradiance: true, ..settings(4, 4, 1) });
        let camera = look_down(1.0, 0.4);
        let (sums, stats) =
            render_reference(gpu(), &world, &camera, &settings, 16, |_| true).unwrap();
        assert_eq!(stats.n_cut, 0, "rays that the driver cut, expected none");
        resolve(&sums, settings.size, Channel::Irradiance).rgb
    };
    let one = irradiance(vec![square(1.0)]);
    for n in [114usize, 150, 500] {
        assert_eq!(
            irradiance(vec![square(1.0); n]),
            one,
            "irradiance of a floor that lies there {n} times, expected that of one"
        );
        let concentric = (1..=n).map(|ix| square(ix as f32 / n as f32)).collect();
        // Another triangle is hit, and the offset off its surface differs by its size: the same light within rounding.
        for (ix, (a, b)) in irradiance(concentric).iter().zip(&one).enumerate() {
            assert!(
                (*a - *b).largest() <= 1e-4 * b.max_element(),
                "irradiance of {n} concentric floors at pixel {ix} is {a}, expected {b} within 1e-4 of it"
            );
        }
    }
}
