// SPDX-License-Identifier: MIT OR Apache-2.0
//! Same input, same bytes; and what is not finite stays out of the picture.

use crate::harness::{KeepNan, Largest, assert_each, differing_bytes, ray_query_gpu};
use crate::support::{
    diffuse, emitter, floor, lambert, look_down, on_gpu, render, render_cut, scene, settings,
};
use glam::{UVec2, Vec3, Vec4};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{LoadLimits, Material, Scene, Sky};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, PixelSums, Work, resolve};
use std::path::Path;

fn cornell() -> Scene {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = root.join("fixtures/scenes/cornell_original/cornell_original.gltf");
    Scene::load(&file, &LoadLimits::default()).unwrap().scene
}

fn bytes(sums: &[PixelSums]) -> &[u8] {
    bytemuck::cast_slice(sums)
}

#[test]
fn the_same_work_gives_the_same_bytes_however_it_is_cut() {
    let world = cornell();
    let camera = world.cameras[0].clone();
    for diffuse_only in [true, false] {
        let world = on_gpu(&world, diffuse_only, RaySource::Software);
        let settings = settings(20, 19, 5);
        let whole = render(&world, &camera, &settings, 6);
        let is_same = |sums: &[PixelSums], how: &str| {
            let (found, expected) = (bytes(sums), bytes(&whole));
            assert!(
                found == expected,
                "diffuse only: {diffuse_only}: sums of the same work {how}: {}",
                differing_bytes(found, expected)
            );
        };
        assert_each(
            &format!("diffuse only: {diffuse_only}: sums of pixels"),
            &whole,
            "of 6 samples, none rejected",
            |pixel| pixel.n_samples == 6 && pixel.n_rejected == 0,
        );
        is_same(&render(&world, &camera, &settings, 6), "once more");
        let cut = |rows: &[u32], samples: &[u32]| {
            let mut cuts = Vec::new();
            let mut first_sample = 0;
            for &n_samples in samples {
                let mut first_row = 0;
                for &n_rows in rows {
                    let continues = false;
                    cuts.push(Work {
                        stripe: 0,
                        first_row,
                        n_rows,
                        first_sample,
                        n_samples,
                        continues,
                    });
                    first_row += n_rows;
                }
                first_sample += n_samples;
            }
            render_cut(&world, &camera, &settings, &cuts)
        };
        is_same(&cut(&[19], &[1; 6]), "sample by sample");
        is_same(&cut(&[1, 7, 8, 3], &[6]), "rows apart");
        is_same(&cut(&[13, 6], &[1, 3, 2]), "rows and samples apart");
        let other =
            settings!(lucerna::techniques::reference::ReferenceSettings { seed: 1, ..settings });
        let with_other = render(&world, &camera, &other, 6);
        assert!(
            bytes(&whole) != bytes(&with_other),
            "diffuse only: {diffuse_only}: sums with seeds 0 and 1 are the same, expected others"
        );
    }
}

/// Both sources of rays draw the same random numbers. Hits differ in the last bits, so a rare
/// path may turn elsewhere; means of 24² pixels × 16 samples stay within 1 %.
#[test]
fn ray_query_and_software_give_the_same_picture() {
    if ray_query_gpu().is_none() {
        return;
    }
    let world = cornell();
    let camera = world.cameras[0].clone();
    let settings = settings(24, 24, 5);
    let [software, hardware] = [RaySource::Software, RaySource::RayQuery].map(|rays| {
        let sums = render(&on_gpu(&world, true, rays), &camera, &settings, 16);
        resolve(&sums, settings.size, Channel::Beauty).rgb
    });
    let close = |(a, b): &(&Vec3, &Vec3)| (**a - **b).largest() <= 1e-3 * a.max_element();
    let same = software.iter().zip(&hardware).filter(close).count();
    let [a, b] = [&software, &hardware].map(|rgb| rgb.iter().sum::<Vec3>().element_sum());
    let identical = software.iter().zip(&hardware).filter(|(a, b)| a == b).count();
    println!(
        "{same} of 576 pixels within 1e-3 ({identical} identical); means differ by {:.2e}",
        (a - b).abs() / a
    );
    assert!(
        same >= 570 && (a - b).abs() <= 0.01 * a,
        "{same} of 576 pixels by ray query are those by software within 1e-3, expected at least 570; their sum is {b}, expected {a} within 1 %"
    );
}

/// The left half of the floor emits NaN, the right half light.
#[test]
fn samples_that_are_not_finite_are_rejected_and_counted() {
    let mut left = floor(10.0, 0.0, 0);
    let mut right = floor(10.0, 0.0, 1);
    left.positions.iter_mut().for_each(|p| p.x = p.x.min(0.0));
    right.positions.iter_mut().for_each(|p| p.x = p.x.max(0.0));
    for (what, bad) in [("NaN", f32::NAN), ("infinity", f32::INFINITY)] {
        let materials = vec![
            Material { emission: Vec3::new(bad, 1.0, 0.0), ..lambert([0.5, 0.25, 1.0]) },
            Material { emission: Vec3::ONE, ..lambert([0.5, 0.25, 1.0]) },
        ];
        let world = diffuse(&scene(vec![left.clone(), right.clone()], materials));
        let size = UVec2::new(9, 4);
        let sums = render(&world, &look_down(1.0, 1.0), &settings(size.x, size.y, 2), 64);
        for channel in [
            Channel::Beauty,
            Channel::Emitted,
            Channel::Direct,
            Channel::Indirect,
            Channel::Irradiance,
            Channel::Albedo,
            Channel::Normal,
            Channel::Depth,
        ] {
            let picture = resolve(&sums, size, channel);
            let finite = picture.check_finite();
            assert!(finite.is_ok(), "{what}: {channel:?} is not finite, expected so: {finite:?}");
            if channel == Channel::Albedo {
                // Samples that are rejected for their light still met the surface.
                let off = |c: &Vec3| (*c - Vec3::new(0.5, 0.25, 1.0)).largest();
                let worst = picture.rgb.iter().map(off).fold(0.0, f32::max_nan);
                assert!(
                    worst < 1e-5,
                    "{what}: albedo is off by {worst} at most, expected below 1e-5"
                );
            }
        }
        for (ix, pixel) in sums.iter().enumerate() {
            let n = pixel.n_rejected;
            match ix % 9 {
                0..4 => assert_eq!(
                    n, 64,
                    "{what}: rejected samples of pixel {ix} on the left, expected all"
                ),
                // Half of it, give or take 6 standard errors.
                4 => assert!(
                    (8..=56).contains(&n),
                    "{what}: {n} of 64 samples of pixel {ix} in the middle are rejected, expected 8 to 56"
                ),
                _ => assert_eq!(n, 0, "{what}: rejected samples of pixel {ix} on the right"),
            }
            assert_eq!(pixel.n_samples, 64, "{what}: samples of pixel {ix}");
        }
        let beauty = resolve(&sums, size, Channel::Beauty);
        for (ix, pixel) in beauty.rgb.iter().enumerate().filter(|(ix, _)| ix % 9 >= 4) {
            assert!(
                (*pixel - Vec3::ONE).largest() < 1e-5,
                "{what}: beauty of pixel {ix} is {pixel}, expected 1 within 1e-5"
            );
        }
    }
}

/// Vertex colours are stored as 16-bit fractions, so what is not finite ends at their limits.
#[test]
fn vertex_colors_that_are_not_finite_give_a_finite_picture() {
    let mut mesh = floor(10.0, 0.0, 0);
    mesh.colors = vec![
        Vec4::NAN,
        Vec4::splat(f32::INFINITY),
        Vec4::splat(f32::NEG_INFINITY),
        Vec4::new(-1.0, 2.0, 0.5, 1.0),
    ];
    let mut world =
        scene(vec![mesh, floor(1.0, 0.3, 1)], vec![lambert([1.0; 3]), emitter([1.0; 3])]);
    world.sky = Sky::Constant(Vec3::ONE);
    let sums = render(&diffuse(&world), &look_down(1.0, 2.0), &settings(8, 8, 3), 32);
    for channel in [Channel::Beauty, Channel::Albedo] {
        let picture = resolve(&sums, UVec2::splat(8), channel);
        assert_each(
            &format!("{channel:?} of pixels"),
            &picture.rgb,
            "finite and at least 0",
            |c| c.is_finite() && c.min_element() >= 0.0,
        );
    }
}
