// SPDX-License-Identifier: MIT OR Apache-2.0
//! Direct light against closed forms and against the path tracer.

use crate::harness::{Estimate, Largest, Tolerance, assert_estimate};
use crate::support::{
    add_texture, ceiling, diffuse, emitter, floor, lambert, look_down, on_gpu, render as trace,
    scene, settings,
};
use crate::whole::{Rendered, accumulated, render};
use glam::{DVec2, DVec3, UVec2, Vec3};
use lucerna::frame::{DirectSettings, ViewSettings};
use lucerna::gpu_scene::{GpuScene, RaySource};
use lucerna::scene::{AlphaMode, Camera, Light, LoadLimits, Material, Projection, Scene, Sky};
use lucerna::settings;
use lucerna::techniques::NoIndirect;
use lucerna::techniques::reference::{Channel, PixelSums, ReferenceSettings, resolve};
use std::f64::consts::PI;
use std::path::Path;

/// A white plane, so that no 8-bit albedo rounds.
fn plane() -> Scene {
    scene(vec![floor(20.0, 0.0, 0)], vec![lambert([1.0; 3])])
}

/// L = E/π with E = I·cosθ/d² at pixel centres. Relative 3e-5: the normal is packed to 6.5e-5 rad (exact
/// for an axis), a dozen f32 roundings, coordinates to 2⁻²² m of 1.
#[test]
fn point_light_over_a_plane() {
    let at = Vec3::new(0.3, 1.5, -0.2);
    let intensity = Vec3::new(10.0, 5.0, 1.0);
    let mut world = plane();
    world.lights.push(Light::Point { position: at, intensity, range: None });
    let size = UVec2::new(24, 16);
    for (what, camera) in [
        ("orthographic", look_down(4.0, 2.0)),
        ("perspective", crate::gbuffer::camera_at(Vec3::new(0.5, 3.0, 4.0), Vec3::ZERO, 50.0)),
    ] {
        let found = render(&diffuse(&world), &camera, size, accumulated(1, 0), 4);
        let lit = found.channel(Channel::Direct);
        for (ix, pixel) in lit.iter().enumerate() {
            let Some((origin, direction)) =
                crate::gbuffer::center_ray(&camera, size, ix as u32 % size.x, ix as u32 / size.x)
                    .into()
            else {
                unreachable!()
            };
            let t = -origin.y / direction.y;
            let point = origin + direction * t;
            if !(t > 0.0 && point.largest() < 19.9) {
                continue;
            }
            let offset = at.as_dvec3() - point;
            let expected = intensity.as_dvec3() * offset.y / offset.length().powi(3) / PI;
            let off = ((pixel.as_dvec3() - expected) / expected).largest();
            assert!(off < 3e-5, "{what}, pixel {ix}: {pixel}, expected {expected}");
        }
    }
}

/// Mean over pixels in the first colour, from 32 seeds.
fn mean_of(world: &Scene, size: UVec2, n_frames: u32, n_samples: u32) -> Estimate {
    let direct = settings!(DirectSettings { n_samples, ..Default::default() });
    mean_with(world, size, n_frames, direct)
}

fn mean_with(world: &Scene, size: UVec2, n_frames: u32, direct: DirectSettings) -> Estimate {
    let on_gpu = diffuse(world);
    let mut found = Rendered::with(&on_gpu, size, direct);
    Estimate::of((0..32).map(|seed| {
        let settings = accumulated(n_frames, seed);
        found.run(&on_gpu, &look_down(0.5, 0.2), settings, &mut NoIndirect);
        let lit = found.channel(Channel::Direct);
        lit.iter().map(|pixel| f64::from(pixel.x)).sum::<f64>() / lit.len() as f64
    }))
}

/// What is not chance: 1e-4 for the plane's finite size and rounding.
const BIAS: Tolerance = Tolerance::relative(1e-4);

/// By the mean's standard error; an error of 1.5 % must show.
fn check_mean(what: &str, world: &Scene, expected: f64) {
    let mean = mean_of(world, UVec2::splat(16), 4, 4);
    assert_estimate(what, mean, expected, BIAS, Tolerance::relative(0.015));
}

/// E = πL, so a white plane reflects L.
#[test]
fn uniform_sky_over_a_plane() {
    let sky = Sky::Constant(Vec3::splat(0.7));
    check_mean("sky", &Scene { sky, ..plane() }, 0.7f32.into());
}

/// However many samples are drawn of lights and of reflections, the mean is the same.
#[test]
fn any_number_of_samples_has_the_same_mean() {
    let world = Scene { sky: Sky::Constant(Vec3::splat(0.7)), ..plane() };
    for (n_samples, n_bsdf_samples) in [(1, 0), (0, 1), (0, 3), (1, 1), (1, 2), (2, 3), (4, 4)] {
        let direct = settings!(DirectSettings { n_samples, n_bsdf_samples, ..Default::default() });
        let mean = mean_with(&world, UVec2::splat(16), 4, direct);
        let what =
            format!("light by {n_samples} samples of lights, {n_bsdf_samples} of reflections");
        assert_estimate(&what, mean, 0.7, BIAS, Tolerance::relative(0.03));
    }
}

/// The same sky as an image.
#[test]
fn image_sky_over_a_plane() {
    let sky = Sky::Image { width: 8, height: 4, rgb: vec![Vec3::splat(0.7); 32] };
    check_mean("sky image", &Scene { sky, ..plane() }, 0.7f32.into());
}

/// A ceiling of half side a at height h over the plane, seen from the origin: view factor of a square
/// to a differential element below its centre, (4/π)·X/√(1+X²)·atan(X/√(1+X²)), X = a/h (Howell, B-3
/// times four). Averaged over the picture's ±0.2 m numerically.
#[test]
fn emissive_quad_over_a_plane() {
    // Corner form: F = (1/2π)[A/√(1+A²)·atan(B/√(1+A²)) + B/√(1+B²)·atan(A/√(1+B²))], A, B = sides/h.
    let corner = |x: f64, y: f64| {
        let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / p * (y / p).atan() + y / q * (x / q).atan()) / (2.0 * PI)
    };
    for (what, half, height) in [("lamp", 0.5, 1.0f64), ("near lamp", 3.0, 0.6)] {
        let mut world = plane();
        world.meshes.push(ceiling(half, height as f32, 1));
        world.instances.push(lucerna::scene::Instance {
            mesh: 1,
            world_from_object: glam::Affine3A::IDENTITY,
        });
        world.materials.push(emitter([2.0, 2.0, 2.0]));
        let n = 64;
        let mut factor = 0.0;
        for ix in 0..n * n {
            let place = |k: u32| (f64::from(k) + 0.5) / f64::from(n) * 0.4 - 0.2;
            let (x, z) = (place(ix % n), place(ix / n));
            let half = f64::from(half);
            for (a, b) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                factor +=
                    corner((half - a * x) / height, (half - b * z) / height) / f64::from(n * n);
            }
        }
        check_mean(what, &world, 2.0 * factor);
    }
}

/// A point light and two unequal lamps together give the sum of what each gives alone: lamps are drawn from an alias table
/// of their own, beside that of all lights. By the errors of all parts; an error of 1.5 % must show.
#[test]
fn lights_add_up() {
    let with = |parts: &[usize]| {
        let mut world = plane();
        for part in parts {
            match part {
                0 => world.lights.push(Light::Point {
                    position: Vec3::new(0.3, 0.6, 0.1),
                    intensity: Vec3::splat(1.0),
                    range: None,
                }),
                _ => {
                    let (half, height, radiance) = [(0.1, 0.8, 30.0), (1.5, 2.0, 0.5)][part - 1];
                    world.materials.push(emitter([radiance; 3]));
                    world.meshes.push(ceiling(half, height, world.materials.len() - 1));
                    let mesh = world.meshes.len() - 1;
                    let world_from_object = glam::Affine3A::IDENTITY;
                    world.instances.push(lucerna::scene::Instance { mesh, world_from_object });
                }
            }
        }
        mean_of(&world, UVec2::splat(16), 4, 4)
    };
    // The small lamp hides nothing of the plane, and a little of the large one.
    let alone = [[0usize].as_slice(), &[1, 2]].map(with);
    let sum = with(&[0, 1, 2]);
    let expected: f64 = alone.iter().map(|of| of.mean).sum();
    let errors = alone.iter().map(|of| of.error * of.error).sum::<f64>() + sum.error * sum.error;
    let sum = Estimate { error: errors.sqrt(), ..sum };
    assert_estimate("light of all", sum, expected, BIAS, Tolerance::relative(0.015));
}

/// More punctual lights than are looped over: they are drawn, and the mean is the same.
#[test]
fn many_lights_are_drawn_few_are_looped_over() {
    let with = |n: u32| {
        let mut world = plane();
        world.lights = (0..n)
            .map(|_| Light::Directional {
                direction: Vec3::NEG_Y,
                irradiance: Vec3::splat(std::f32::consts::PI / n as f32),
            })
            .collect();
        world
    };
    for n in [1, 16, 17, 100] {
        let mean = mean_of(&with(n), UVec2::splat(8), 2, 4);
        let rounding = Tolerance::absolute(1e-5);
        let what = format!("light of {n} equal suns");
        assert_estimate(&what, mean, 1.0, rounding, Tolerance::absolute(1e-4));
    }
}

/// Irradiance is asked for: whatever the material, π·L of a white Lambertian.
#[test]
fn irradiance_is_that_of_a_white_surface() {
    let mut world = scene(
        vec![floor(20.0, 0.0, 0)],
        vec![Material { metallic: 1.0, roughness: 0.3, ..lambert([0.2, 0.5, 0.1]) }],
    );
    world.lights.push(Light::Directional {
        direction: Vec3::new(0.6, -0.8, 0.0),
        irradiance: Vec3::new(3.0, 2.0, 1.0),
    });
    let settings = settings!(ViewSettings { irradiance: true, ..accumulated(2, 0) });
    let on_gpu = on_gpu(&world, false, RaySource::Software);
    let found = render(&on_gpu, &look_down(1.0, 1.0), UVec2::splat(4), settings, 4);
    for pixel in found.channel(Channel::Irradiance) {
        let expected = Vec3::new(3.0, 2.0, 1.0) * 0.8;
        assert!(((pixel - expected) / expected).largest() < 1e-5, "{pixel}");
    }
    for pixel in found.channel(Channel::Albedo) {
        // Half a step of 8 bits in sRGB is 3e-3 at 0.5; lavapipe decodes it 1.3e-3 off.
        assert!((pixel - Vec3::new(0.2, 0.5, 0.1)).largest() < 5e-3, "{pixel}");
    }
}

struct Compared {
    mean: DVec3,
    reference: DVec3,
    rmse: f64,
}

fn compare(a: &[Vec3], b: &[Vec3], keep: impl Fn(usize) -> bool) -> Compared {
    let n = (0..a.len()).filter(|&ix| keep(ix)).count() as f64;
    let sum = |p: &[Vec3]| {
        (0..p.len()).filter(|&ix| keep(ix)).map(|ix| p[ix].as_dvec3()).sum::<DVec3>() / n
    };
    let square: f64 = (0..a.len())
        .filter(|&ix| keep(ix))
        .map(|ix| (a[ix].as_dvec3() - b[ix].as_dvec3()).length_squared())
        .sum();
    Compared { mean: sum(a), reference: sum(b), rmse: (square / (3.0 * n)).sqrt() }
}

/// The path tracer's direct light twice, with different seeds: 256 paths a pixel each.
fn references(world: &GpuScene, camera: &Camera, side: u32) -> [Vec<PixelSums>; 2] {
    [0, 1].map(|seed| {
        trace(world, camera, &settings!(ReferenceSettings { seed, ..settings(side, side, 0) }), 256)
    })
}

/// Mean emitted radiance of a square picture from the areas of all emissive triangles' projections, in
/// f64; nothing may hide them or cut them off.
fn projected_emission(scene: &Scene, camera: &Camera) -> DVec3 {
    let Projection::Perspective { vertical_fov } = camera.projection else { panic!() };
    let half = (0.5 * f64::from(vertical_fov)).tan();
    let [forward, up] = [camera.forward, camera.up].map(|v| v.as_dvec3());
    let right = forward.cross(up);
    let mut sum = DVec3::ZERO;
    for instance in &scene.instances {
        let mesh = &scene.meshes[instance.mesh];
        let emission = scene.materials[mesh.material].emission.as_dvec3();
        for triangle in mesh.triangles.iter().filter(|_| emission != DVec3::ZERO) {
            let [a, b, c] = triangle.map(|v| {
                let world = instance.world_from_object.transform_point3(mesh.positions[v as usize]);
                let offset = (world - camera.position).as_dvec3();
                DVec2::new(offset.dot(right), offset.dot(up)) / (2.0 * half * offset.dot(forward))
            });
            sum += emission * (0.5 * (b - a).perp_dot(c - a).abs());
        }
    }
    sum
}

/// The Cornell box, without the pixels that see the lamp. Each mean within 0.5 %: 8-bit albedos are
/// right to 0.3 % (half a step in sRGB is 1 % of 0.05 and 0.2 % of 0.5). RMSE: 64 frames of 5 samples, in
/// stratified places, are not noisier than 256 independent paths, so the picture differs from a reference no more
/// than two references do from each other; a tenth for chance and for albedos.
#[test]
fn cornell_box_is_as_the_path_tracer_sees_it() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let file = root.join("scenes/cornell_original/cornell_original.gltf");
    let loaded = Scene::load(&file, &LoadLimits::default()).unwrap().scene;
    let camera = loaded.cameras[0].clone();
    let world = diffuse(&loaded);
    let size = UVec2::splat(40);
    let found = render(&world, &camera, size, accumulated(64, 1), 4);
    let sums = references(&world, &camera, 40);
    let truth = |channel| resolve(&sums[0], size, channel).rgb;
    let emitted = [found.channel(Channel::Emitted), truth(Channel::Emitted)];
    let dark = |ix: usize| emitted.iter().all(|picture| picture[ix] == Vec3::ZERO);
    let c = compare(&found.channel(Channel::Direct), &truth(Channel::Direct), dark);
    let noise =
        compare(&resolve(&sums[1], size, Channel::Direct).rgb, &truth(Channel::Direct), dark);
    println!("Cornell: {} against {}, RMSE {:.5}, {:.5}", c.mean, c.reference, c.rmse, noise.rmse);
    let off = ((c.mean - c.reference) / c.reference).largest();
    assert!(
        off < 0.005,
        "Cornell: mean of direct light {}, expected {} to 0.5 %",
        c.mean,
        c.reference
    );
    assert!(c.rmse < 1.1 * noise.rmse, "RMSE {} and {}", c.rmse, noise.rmse);
    // The lamp hangs before everything else: its share of the picture is the area of its projection.
    // (Two references of 256 paths a pixel differ by 2 % here, for the lamp covers few pixels.) Of about
    // 14 pixels on its outline, 64 places each; stratified, an edge's error is below 64^(-3/4) = 4 % of a
    // pixel, the sum's below 0.15 of the lamp's 10 pixels.
    let expected = projected_emission(&loaded, &camera);
    let mean = compare(&emitted[0], &emitted[0], |_| true).mean;
    println!("lamp: {mean} for {expected}");
    assert!(((mean - expected) / expected).largest() < 0.015, "{mean} for {expected}");
    for channel in [Channel::Depth, Channel::Normal] {
        let c = compare(&found.channel(channel), &truth(channel), |_| true);
        let scale = c.reference.largest();
        let off = (c.mean - c.reference).largest();
        assert!(
            off < 0.005 * scale,
            "mean of {channel:?} {}, expected {} to 0.5 %",
            c.mean,
            c.reference
        );
    }
}

/// A textured floor under a textured mask, glossy and diffuse, lit by the sun and an area light.
#[test]
fn masked_and_textured_scene_is_as_the_path_tracer_sees_it() {
    let mut world = scene(
        vec![floor(4.0, 0.0, 0), floor(1.0, 0.6, 1), ceiling(0.4, 2.0, 2)],
        vec![lambert([1.0; 3]), lambert([0.9, 0.7, 0.5]), emitter([8.0; 3])],
    );
    let checker = (0..64u32).map(|ix| {
        if (ix + ix / 8).is_multiple_of(2) { [230, 188, 120, 255] } else { [90, 90, 200, 255] }
    });
    let texture = add_texture(&mut world, 8, checker.collect());
    world.materials[0].base_color_texture = Some(texture);
    let holes = (0..64u32).map(|ix| [255, 255, 255, if ix * 7 % 5 < 2 { 0 } else { 255 }]);
    let texture = add_texture(&mut world, 8, holes.collect());
    world.materials[1].base_color_texture = Some(texture);
    world.materials[1].alpha = AlphaMode::Mask { cutoff: 0.5 };
    world.lights.push(Light::Directional {
        direction: Vec3::new(0.3, -0.9, 0.2).normalize(),
        irradiance: Vec3::splat(3.0),
    });
    let camera =
        crate::gbuffer::camera_at(Vec3::new(0.3, 1.9, 2.4), Vec3::new(0.0, 0.2, 0.0), 50.0);
    let size = UVec2::splat(32);
    for (what, diffuse_only) in [("diffuse", true), ("dielectric", false)] {
        if !diffuse_only {
            world.materials[0].roughness = 0.35;
            world.materials[1].metallic = 1.0;
            world.materials[1].roughness = 0.5;
        }
        let world = on_gpu(&world, diffuse_only, RaySource::Software);
        let found = render(&world, &camera, size, accumulated(64, 1), 4);
        let [a, b] =
            references(&world, &camera, 32).map(|sums| resolve(&sums, size, Channel::Direct).rgb);
        let c = compare(&found.channel(Channel::Direct), &a, |_| true);
        let noise = compare(&b, &a, |_| true);
        println!(
            "{what}: {} against {}, RMSE {:.5}, {:.5}",
            c.mean, c.reference, c.rmse, noise.rmse
        );
        // Borders of shadows and holes are met by 64 places in each pixel, the same in all pixels, and not by 256: an
        // RMSE twice as large.
        let (found, limit) = (c.rmse, 2.0 * noise.rmse);
        assert!(
            found < limit,
            "{what}: RMSE {found:.5}, expected below {limit:.5}, twice a reference's"
        );
        // The mean of direct light by both, from as many seeds each.
        let size = UVec2::splat(20);
        let mut frames = Rendered::new(&world, size, 4);
        let ratios = (0..16).map(|seed| {
            frames.run(&world, &camera, accumulated(32, seed), &mut NoIndirect);
            let found = frames.channel(Channel::Direct);
            let settings = settings!(ReferenceSettings { seed: 100 + seed, ..settings(20, 20, 0) });
            let truth = resolve(&trace(&world, &camera, &settings, 64), size, Channel::Direct).rgb;
            let c = compare(&found, &truth, |_| true);
            c.mean.element_sum() / c.reference.element_sum()
        });
        // 8-bit albedos are right to 0.3 %; and borders by 32 places a pixel, of about 200 pixels.
        let (bias, resolves) = (Tolerance::absolute(0.004), Tolerance::absolute(0.015));
        let name = format!("{what} direct light by that of the path tracer");
        let off = assert_estimate(&name, Estimate::of(ratios), 1.0, bias, resolves);
        println!("{name}: {off:.2} of what chance and bias explain");
    }
}

/// Neither acne nor gaps: a lit plane at grazing angles, far from the origin and from the camera, is
/// bright in every pixel and frame; a wall that touches it leaves no lit seam behind it.
#[test]
fn no_acne_and_no_leaks() {
    let center = Vec3::new(300.0, -40.0, 700.0);
    let mut world = scene(vec![floor(60.0, 0.0, 0)], vec![lambert([1.0; 3])]);
    world.instances[0].world_from_object =
        glam::Affine3A::from_rotation_translation(glam::Quat::from_rotation_z(-0.15), center);
    world.lights.push(Light::Directional {
        direction: Vec3::new(0.95, -0.2, 0.1).normalize(),
        irradiance: Vec3::ONE,
    });
    let normal = glam::Quat::from_rotation_z(-0.15) * Vec3::Y;
    let cosine = -normal.dot(Vec3::new(0.95, -0.2, 0.1).normalize());
    assert!(cosine.abs() > 0.05, "{cosine}");
    let eye = center + glam::Quat::from_rotation_z(-0.15) * Vec3::new(-30.0, 1.0, 20.0);
    let camera = crate::gbuffer::camera_at(eye, center, 60.0);
    let size = UVec2::new(64, 48);
    let found = render(&diffuse(&world), &camera, size, accumulated(4, 0), 4);
    let depth = found.channel(Channel::Depth);
    let lit = found.channel(Channel::Direct);
    let expected = cosine.max(0.0) / std::f32::consts::PI;
    for (ix, pixel) in lit.iter().enumerate() {
        // The horizon's pixels are partly sky.
        if found.sums[ix].n_surfaces == 4 {
            let off = (pixel.x - expected).abs();
            assert!(off < 3e-5, "pixel {ix} at {}: {pixel}, expected {expected}", depth[ix].x);
        }
    }
}
