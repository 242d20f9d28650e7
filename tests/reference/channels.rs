// SPDX-License-Identifier: MIT OR Apache-2.0
//! Albedo, normal and depth against closed forms.

use crate::harness::{Largest, assert_each};
use crate::support::{
    ceiling, diffuse, floor, lambert, look_down, over_pixels, render, scene, settings,
};
use glam::{Affine3A, DVec3, UVec2, Vec3};
use lucerna::scene::{Camera, Projection};
use lucerna::settings;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};

const ALBEDO: [f32; 3] = [0.8, 0.5, 0.2];

/// A plane turned by 30° about Z, seen from its front and from its back by parallel rays, and by a
/// pinhole of 90° as a plane across the view. Depth is measured along the axis, normals point to
/// the camera. Tolerances: normals are packed to 16 bits an axis (2e-5); f32 means of 64 jittered
/// samples leave a pixel's depth uncertain by its slope × a pixel's width × √(1/(12·64)) × 5.
#[test]
fn surface_channels_of_a_plane() {
    let mut world = scene(vec![floor(10.0, 0.0, 0)], vec![lambert(ALBEDO)]);
    world.instances[0].world_from_object = Affine3A::from_rotation_z(30f32.to_radians());
    let gpu_scene = diffuse(&world);
    let size = UVec2::splat(8);
    let tilt = 30f64.to_radians();
    for from_above in [true, false] {
        let mut camera = look_down(4.0, 1.0);
        if !from_above {
            camera.position.y = -4.0;
            camera.forward = Vec3::Y;
        }
        let sums = render(&gpu_scene, &camera, &settings(8, 8, 0), 64);
        let side = if from_above { 1.0 } else { -1.0 };
        // Looking up, with −Z up in the picture, columns grow against x.
        let depth = over_pixels(size, |p| DVec3::splat(4.0 - side * side * p.x * tilt.tan()));
        let normal = side as f32 * Vec3::new(-tilt.sin() as f32, tilt.cos() as f32, 0.0);
        let albedo = resolve(&sums, size, Channel::Albedo);
        let normals = resolve(&sums, size, Channel::Normal);
        let depths = resolve(&sums, size, Channel::Depth);
        for (ix, expected) in depth.iter().enumerate() {
            let what = format!("from above: {from_above}, pixel {ix}");
            assert!(
                (albedo.rgb[ix] - Vec3::from(ALBEDO)).largest() < 1e-5,
                "{what}: albedo is {}, expected {ALBEDO:?} within 1e-5",
                albedo.rgb[ix]
            );
            assert!(
                (normals.rgb[ix] - normal).largest() < 3e-5,
                "{what}: normal is {}, expected {normal} within 3e-5",
                normals.rgb[ix]
            );
            let off = (f64::from(depths.rgb[ix].x) - expected.x).abs();
            let bound = 5.0 * 0.25 * tilt.tan() / (12.0f64 * 64.0).sqrt();
            assert!(
                off < bound,
                "{what}: depth is {}, expected {} within {bound:.4}",
                depths.rgb[ix].x,
                expected.x
            );
        }
    }

    world.instances[0].world_from_object = Affine3A::IDENTITY;
    let camera = Camera {
        projection: Projection::Perspective { vertical_fov: 90f32.to_radians() },
        ..look_down(3.0, 1.0)
    };
    let sums = render(&diffuse(&world), &camera, &settings(8, 8, 0), 16);
    let depths = resolve(&sums, size, Channel::Depth);
    assert_each("depth of pixels of a plane across the view", &depths.rgb, "3 within 1e-5", |d| {
        (d.x - 3.0).abs() < 1e-5
    });
}

/// A half covered pixel has half the albedo, and the depth and normal of what covers it.
#[test]
fn surface_channels_where_a_plane_ends() {
    let world = diffuse(&scene(vec![floor(1.0, 0.0, 0)], vec![lambert(ALBEDO)]));
    let size = UVec2::splat(4);
    // The plane ends in the middle of the outer pixels.
    let sums = render(&world, &look_down(3.0, 4.0 / 3.0), &settings(4, 4, 0), 4096);
    let albedo = resolve(&sums, size, Channel::Albedo);
    let depths = resolve(&sums, size, Channel::Depth);
    let normals = resolve(&sums, size, Channel::Normal);
    for ix in 0..16 {
        let is_border = |k: usize| k == 0 || k == 3;
        let share = [ix % 4, ix / 4].map(|k| if is_border(k) { 0.5 } else { 1.0 });
        let share: f32 = share[0] * share[1];
        // 5 standard errors of a share of 4096 samples, and as many roundings of an f32 sum.
        let noise = 5.0 * (share * (1.0 - share) / 4096.0).sqrt() + 2.4e-4;
        let off = (albedo.rgb[ix] - share * Vec3::from(ALBEDO)).largest();
        assert!(
            off <= noise,
            "albedo of pixel {ix} is {}, expected {share} of {ALBEDO:?} within {noise:.2e}",
            albedo.rgb[ix]
        );
        assert!(
            (depths.rgb[ix].x - 3.0).abs() < 1e-4,
            "depth of pixel {ix} is {}, expected 3 within 1e-4",
            depths.rgb[ix].x
        );
        assert!(
            (normals.rgb[ix] - Vec3::Y).largest() < 3e-5,
            "normal of pixel {ix} is {}, expected {} within 3e-5",
            normals.rgb[ix],
            Vec3::Y
        );
    }
    // Nothing at all: zeros.
    let sums =
        render(&diffuse(&scene(vec![], vec![])), &look_down(3.0, 1.0), &settings(4, 4, 3), 4);
    for channel in [Channel::Beauty, Channel::Albedo, Channel::Depth, Channel::Normal] {
        assert_each(
            &format!("{channel:?} of pixels of an empty scene"),
            &resolve(&sums, size, channel).rgb,
            "0",
            |&pixel| pixel == Vec3::ZERO,
        );
    }
}

/// A floor under a ceiling at height h: of rays that end at D, those within acos(h/D) of the normal are stopped, a share
/// 1 − (h/D)² by the cosine; with D < h none. 8 × 8 pixels of 512 samples: σ of the mean is 0.0027 at most, the bound 4 σ.
#[test]
fn openness_under_a_ceiling() {
    let height = 0.5;
    let meshes = vec![floor(50.0, 0.0, 0), ceiling(50.0, height, 0)];
    let world = diffuse(&scene(meshes, vec![lambert([0.5; 3])]));
    for distance in [0.4f64, 0.6, 1.0, 2.0] {
        let settings = settings!(ReferenceSettings {
            occlusion_distance: distance as f32,
            ..settings(8, 8, 0)
        });
        let sums = render(&world, &look_down(0.25, 0.1), &settings, 512);
        let picture = resolve(&sums, UVec2::splat(8), Channel::Openness).rgb;
        let mean = picture.iter().map(|v| f64::from(v.x)).sum::<f64>() / picture.len() as f64;
        let expected = (f64::from(height) / distance).powi(2).min(1.0);
        assert!(
            (mean - expected).abs() < 0.011,
            "mean openness to {distance} m is {mean}, expected {expected} within 0.011"
        );
        if expected >= 1.0 {
            assert_each(&format!("openness of pixels to {distance} m"), &picture, "1", |v| {
                v.x == 1.0
            });
        }
    }
}
