// SPDX-License-Identifier: MIT OR Apache-2.0
//! Drivers that end loops early (Mesa 22's llvmpipe: after 65 535 iterations an invocation) cost no sample and no ray.

use crate::harness::{Largest, gpu};
use crate::support::{add_texture, diffuse, lambert, look_down, quad, scene, settings};
use glam::Vec3;
use lucerna::blocking::render_reference;
use lucerna::scene::{AlphaMode, Material, Scene, Sky};
use lucerna::techniques::reference::{Channel, resolve};

/// A floor of albedo 0.8 below layers that an alpha mask cuts away everywhere.
fn floor_below_layers(n_layers: u32) -> Scene {
    let square = |y: f32, material| {
        quad([[-1.0, y, -1.0], [-1.0, y, 1.0], [1.0, y, 1.0], [1.0, y, -1.0]], material)
    };
    let mut meshes = vec![square(0.0, 0)];
    meshes.extend((1..=n_layers).map(|layer| square(layer as f32 * 1e-3, 1)));
    let layer = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..lambert([0.1; 3]) };
    let mut scene = scene(meshes, vec![lambert([0.8; 3]), layer]);
    let clear = add_texture(&mut scene, 1, vec![[255, 255, 255, 0]]);
    scene.materials[1].base_color_texture = Some(clear);
    scene.sky = Sky::Constant(Vec3::ONE);
    scene
}

/// Of a pixel that sees a plane of one albedo, every sample is that albedo, however many there are: within the rounding of
/// up to 1024 additions in f32 (`MAX_SUMMED`), 1024·2⁻²⁵.
#[test]
fn rays_get_through_all_layers_however_many_samples_there_are() {
    let scene = diffuse(&floor_below_layers(200));
    let camera = look_down(2.0, 0.5);
    for (size, n_samples, n_bounces) in [(4, 1, 0), (2, 64, 0), (1, 4096, 0), (2, 16, 4)] {
        let settings = settings(size, size, n_bounces);
        let (sums, stats) =
            render_reference(gpu(), &scene, &camera, &settings, n_samples, |_| true).unwrap();
        println!("{n_samples} samples: {stats:?}");
        let what = format!("{size} × {size} pixels, {n_samples} samples, {n_bounces} bounces");
        assert_eq!(stats.n_cut, 0, "{what}: rays that the driver cut, expected none");
        for (ix, pixel) in sums.iter().enumerate() {
            assert_eq!(
                (pixel.n_samples, pixel.n_rejected, pixel.n_surfaces),
                (n_samples, 0, n_samples),
                "{what}: samples, rejected ones and surfaces of pixel {ix}"
            );
        }
        let albedo = resolve(&sums, settings.size, Channel::Albedo).rgb;
        for (ix, rgb) in albedo.into_iter().enumerate() {
            assert!(
                (rgb - 0.8).largest() <= 0.8 * 3.1e-5,
                "{what}: albedo of pixel {ix} is {rgb}, expected 0.8 within 3.1e-5 of it"
            );
        }
    }
}

/// Ten million samples of one pixel all arrive, and their mean is right: sums in f32 alone would stop growing.
#[test]
fn ten_million_samples_arrive() {
    let mut scene = floor_below_layers(0);
    scene.sky = Sky::Constant(Vec3::new(0.1, 0.3, 1.0));
    // Looks past the floor, into the sky.
    let camera = lucerna::scene::Camera {
        position: Vec3::new(0.0, 1.0, 0.0),
        forward: Vec3::Y,
        up: Vec3::Z,
        ..look_down(1.0, 0.5)
    };
    let settings = settings(1, 1, 0);
    let n = 10_000_000;
    let (sums, stats) =
        render_reference(gpu(), &diffuse(&scene), &camera, &settings, n, |_| true).unwrap();
    println!("{stats:?}");
    assert_eq!(sums[0].n_samples, n, "samples that arrive at the pixel");
    assert_eq!(
        (sums[0].n_rejected, sums[0].n_surfaces, stats.n_samples),
        (0, 0, n),
        "rejected samples, surfaces, and samples that are counted"
    );
    let mean = resolve(&sums, settings.size, Channel::Beauty).rgb[0];
    let error = (mean / Vec3::new(0.1, 0.3, 1.0) - 1.0).largest();
    assert!(
        error <= 3.1e-5,
        "beauty of {n} samples is {mean}, expected {} within 3.1e-5 of it",
        Vec3::new(0.1, 0.3, 1.0)
    );
}
