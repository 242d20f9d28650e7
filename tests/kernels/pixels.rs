// SPDX-License-Identifier: MIT OR Apache-2.0
//! The kernels of a picture's pixels, over surfaces that are made up.

use crate::bsdf::Material;
use crate::harness::{Largest, Random, gpu, read, storage, submit};
use crate::picture::{
    POISON, Picture, PixelRecord, color, pixel_module, random_surface, target, texels, texture,
};
use bytemuck::Zeroable;
use glam::{DVec3, UVec2, UVec4, Vec3, Vec4};
use lucerna::film::PixelSums;
use lucerna::gpu::{ComputeKernel, Dispatch};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Light, Material as SceneMaterial, Mesh, Scene, Sky};
use lucerna::seam::SceneSeam;
use std::f64::consts::PI;

/// Sizes that are and are not multiples of a workgroup, and pictures of one pixel, row and column.
const SIZES: [UVec2; 5] =
    [UVec2::ONE, UVec2::new(8, 16), UVec2::new(13, 9), UVec2::new(1, 17), UVec2::new(31, 1)];

/// A scene whose kernels take the picture's surfaces from the test.
fn on_gpu(world: &Scene) -> GpuScene {
    GpuScene::new(gpu(), world, GpuSceneOptions::default()).unwrap().with_module(pixel_module())
}

/// A sky of one colour above, and of another one below.
fn two_skies() -> Sky {
    let rgb = (0..32)
        .map(|ix| if ix < 16 { Vec3::new(3.0, 2.0, 1.0) } else { Vec3::new(0.25, 0.5, 0.75) });
    Sky::Image { width: 8, height: 4, rgb: rgb.collect() }
}

/// `frame/composite` adds what a frame found to the sums and shows their mean, over stripes of rows: with and without
/// sums before and indirect light, over surfaces and sky, and with light that is not finite. Each sum is one addition of
/// f32; the mean has four roundings. The sky is read between equal texels, so it is exact but for 1e-6.
#[test]
fn composite_adds_a_frame_to_the_sums() {
    let scene = on_gpu(&Scene { sky: two_skies(), ..Scene::default() });
    let kernel = ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "frame/composite");
    let mut random = Random(61);
    for size in SIZES {
        for case in 0..4u32 {
            let (is_first, has_indirect) = (case & 1, case >> 1);
            let picture = Picture::new(size, |_| {
                let mut found = random_surface(&mut random);
                // No sky where the two colours meet.
                found.is_surface = u32::from(random.unit() < 0.7 || found.to_viewer.y.abs() < 0.8);
                if random.unit() < 0.1 {
                    found.emission.y = f32::NAN;
                }
                found
            });
            let light = |random: &mut Random| {
                let found = color(random).extend(random.unit());
                if random.unit() < 0.1 { found.with_z(f32::INFINITY) } else { found }
            };
            let n = size.element_product() as usize;
            let direct: Vec<Vec4> = (0..n).map(|_| light(&mut random)).collect();
            let mut indirect: Vec<Vec4> = (0..n).map(|_| light(&mut random)).collect();
            let mut indirect_size = size;
            if has_indirect == 0 {
                (indirect, indirect_size) = (vec![Vec4::ZERO], UVec2::ONE);
            }
            let first_row = size.y / 3;
            let n_rows = size.y - first_row - u32::from(size.y > 8);
            let n_sums = (n_rows * size.x) as usize;
            let before: Vec<PixelSums> = (0..n_sums + 5)
                .map(|_| PixelSums {
                    emitted: color(&mut random),
                    n_samples: 7,
                    direct: color(&mut random),
                    n_rejected: (random.unit() * 3.0) as u32,
                    indirect: color(&mut random),
                    depth: random.unit(),
                    albedo: color(&mut random),
                    n_surfaces: 4,
                    normal: random.direction(),
                    openness: random.unit(),
                })
                .collect();
            let sums = storage(bytemuck::cast_slice(&before));
            let beauty = target(size);
            let (direct_texture, indirect_texture) =
                (texture(size, &direct), texture(indirect_size, &indirect));
            submit(|recorder| {
                kernel
                    .call(&mut recorder.compute("test"))
                    .scene(scene.group())
                    .uniform("info", &UVec4::new(first_row, n_rows, is_first, has_indirect))
                    .bind("direct", &direct_texture)
                    .bind("indirect", &indirect_texture)
                    .bind("sums", &sums)
                    .bind("beauty", &beauty)
                    .with(picture.bindings())
                    .dispatch(Dispatch::Area(UVec2::new(size.x, n_rows)));
            });
            let after: Vec<PixelSums> = bytemuck::pod_collect_to_vec(&read(&sums));
            let shown = texels(&beauty);
            let first = (first_row * size.x) as usize;
            for (ix, pixel) in picture.records.iter().enumerate() {
                let what = format!("{size}, first {is_first}, indirect {has_indirect}, pixel {ix}");
                let Some(slot) = ix.checked_sub(first).filter(|&slot| slot < n_sums) else {
                    assert_eq!(shown[ix], Vec4::splat(POISON), "{what}: beauty of another stripe");
                    continue;
                };
                let is_surface = pixel.is_surface != 0;
                let sky = if pixel.to_viewer.y < 0.0 {
                    Vec3::new(3.0, 2.0, 1.0)
                } else {
                    Vec3::new(0.25, 0.5, 0.75)
                };
                let emitted = if is_surface { pixel.emission } else { sky };
                let found = if has_indirect != 0 { indirect[ix] } else { Vec4::ZERO };
                let finite = emitted.is_finite()
                    && direct[ix].truncate().is_finite()
                    && found.truncate().is_finite();
                let mut expected = if is_first != 0 { PixelSums::zeroed() } else { before[slot] };
                expected.n_samples += 1;
                if is_surface {
                    expected.albedo += pixel.base_color;
                    expected.normal += pixel.shading_normal;
                    expected.depth += pixel.depth;
                    expected.n_surfaces += 1;
                }
                expected.openness += if is_surface && has_indirect != 0 { found.w } else { 1.0 };
                if finite {
                    expected.emitted += emitted;
                    expected.direct += direct[ix].truncate();
                    expected.indirect += found.truncate();
                } else {
                    expected.n_rejected += 1;
                }
                let actual = after[slot];
                let close = |a: Vec3, b: Vec3| (a - b).largest() <= 1e-5;
                let counts = |of: PixelSums| [of.n_samples, of.n_rejected, of.n_surfaces];
                assert!(
                    counts(actual) == counts(expected)
                        && close(actual.emitted, expected.emitted)
                        && actual.direct == expected.direct
                        && actual.indirect == expected.indirect
                        && actual.albedo == expected.albedo
                        && actual.normal == expected.normal
                        && actual.depth == expected.depth
                        && actual.openness == expected.openness,
                    "{what}: sums {actual:?}, expected {expected:?} (emission to 1e-5, else exactly)"
                );
                let n = (expected.n_samples - expected.n_rejected).max(1);
                let total = expected.emitted.as_dvec3()
                    + expected.direct.as_dvec3()
                    + expected.indirect.as_dvec3();
                let mean = (total / f64::from(n)).extend(1.0);
                let off = (shown[ix].as_dvec4() - mean).largest();
                assert!(off < 1e-5, "{what}: beauty {}, expected {mean} to 1e-5", shown[ix]);
            }
            let left = bytemuck::cast_slice::<_, u32>(&before[n_sums..]);
            let right = bytemuck::cast_slice::<_, u32>(&after[n_sums..]);
            assert_eq!(left, right, "{size}: sums behind the picture's last");
        }
    }
}

/// Points, spots and suns of a scene: `n` of them.
fn punctual_lights(random: &mut Random, n: u32) -> Vec<Light> {
    (0..n)
        .map(|ix| {
            let intensity = Vec3::new(random.range(0.5, 9.0), random.range(0.5, 9.0), 1.0);
            let position = 5.0 * random.direction();
            match ix % 3 {
                0 => Light::Point {
                    position,
                    intensity,
                    range: (ix % 2 == 1).then_some(random.range(4.0, 9.0)),
                },
                1 => Light::Directional { direction: random.direction(), irradiance: intensity },
                _ => Light::Spot {
                    position,
                    direction: -position.normalize(),
                    intensity,
                    inner: 0.2,
                    outer: 0.6,
                    range: None,
                },
            }
        })
        .collect()
}

/// What a light sends to a point: direction towards it, and irradiance on what faces it. KHR_lights_punctual: falls by
/// 1/d², times clamp(1 − (d/range)⁴, 0, 1) of a range; a spot's share is the square of
/// clamp((cos − cos outer)/(cos inner − cos outer), 0, 1).
pub fn sent(light: &Light, at: DVec3) -> (DVec3, DVec3) {
    match *light {
        Light::Directional { direction, irradiance } => {
            (-direction.as_dvec3(), irradiance.as_dvec3())
        }
        Light::Point { position, intensity, range } => {
            let offset = position.as_dvec3() - at;
            let distance = offset.length();
            let fades = range
                .map_or(1.0, |range| (1.0 - (distance / f64::from(range)).powi(4)).clamp(0.0, 1.0));
            (offset / distance, intensity.as_dvec3() * fades / (distance * distance))
        }
        Light::Spot { position, direction, intensity, inner, outer, .. } => {
            let offset = position.as_dvec3() - at;
            let distance = offset.length();
            let cosine = -direction.as_dvec3().dot(offset) / distance;
            let (inner, outer) = (f64::from(inner).cos(), f64::from(outer).cos());
            let share = ((cosine - outer) / (inner - outer)).clamp(0.0, 1.0).powi(2);
            (offset / distance, intensity.as_dvec3() * share / (distance * distance))
        }
    }
}

/// The frame of a normal, in f64: any will do, the reflection is the same all round.
fn local(normal: DVec3, direction: DVec3) -> DVec3 {
    let (x, y) = normal.any_orthonormal_pair();
    DVec3::new(direction.dot(x), direction.dot(y), direction.dot(normal))
}

/// A scene of one small triangle far away, which hides nothing, with these lights.
fn far_triangle(lights: Vec<Light>) -> Scene {
    let positions =
        vec![Vec3::splat(1e4), Vec3::new(1e4, 1e4, 1e4 + 0.1), Vec3::new(1e4, 1e4 + 0.1, 1e4)];
    Scene {
        meshes: vec![Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }],
        instances: vec![Instance { mesh: 0, world_from_object: glam::Affine3A::IDENTITY }],
        materials: vec![SceneMaterial::default()],
        lights,
        ..Scene::default()
    }
}

/// A square of half side 1 across an axis at 2 m from the origin, towards the positive side.
fn screen(axis: usize) -> Mesh {
    let corner = |a: f32, b: f32| {
        let mut at = Vec3::ZERO;
        (at[axis], at[(axis + 1) % 3], at[(axis + 2) % 3]) = (3.0, a, b);
        at
    };
    Mesh {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// Whether a ray towards a light meets one of the screens, and by how much it misses the border.
fn hidden_by_screens(at: DVec3, to_light: DVec3, distance: f64) -> (bool, f64) {
    let (mut hidden, mut margin) = (false, f64::INFINITY);
    for axis in 0..3 {
        let t = (3.0 - at[axis]) / to_light[axis];
        let hit = at + t * to_light;
        let side = hit[(axis + 1) % 3].abs().max(hit[(axis + 2) % 3].abs());
        if t > -0.01 && t < distance + 0.01 {
            margin = margin.min((side - 1.0).abs());
            hidden |= t > 0.0 && t < distance && side < 1.0;
        }
    }
    (hidden, margin)
}

/// `frame/direct` adds each of up to 16 lights without extent exactly: glTF's reflection times the irradiance, over any
/// surfaces, shadowed by screens; without lights it is dark. Tolerance: the terms of the reflection are good to some 1e-5
/// (its own tests), more where a lobe is narrow, as for those.
#[test]
fn direct_light_is_reflected_as_in_f64() {
    let mut random = Random(62);
    for (n_lights, size) in [0, 1, 3, 7, 16].into_iter().zip(SIZES) {
        let mut world = far_triangle(punctual_lights(&mut random, n_lights));
        for axis in 0..3 {
            world.meshes.push(screen(axis));
            let world_from_object = glam::Affine3A::IDENTITY;
            world.instances.push(Instance { mesh: axis + 1, world_from_object });
        }
        let scene = on_gpu(&world);
        let kernel =
            ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "frame/direct");
        let (mut n_lit, mut n_hidden) = (0, 0);
        let picture = Picture::new(size, |pixel| {
            let mut found = random_surface(&mut random);
            found.is_surface = u32::from(size == UVec2::ONE || (pixel.x + 2 * pixel.y) % 7 != 3);
            found.lambert = (pixel.x + pixel.y) % 3 / 2;
            found
        });
        let found = run_direct(&kernel, &scene, &picture, [1, 0], (0, 0));
        for (ix, (pixel, &texel)) in picture.records.iter().zip(&found).enumerate() {
            if pixel.is_surface == 0 {
                assert_eq!(texel, Vec4::ZERO, "{size}, pixel {ix} of the sky");
                continue;
            }
            let at = pixel.position.as_dvec3();
            let normal = pixel.shading_normal.as_dvec3().normalize();
            let material = Material::new(pixel.albedo, pixel.metallic, pixel.roughness);
            let wo = local(normal, pixel.to_viewer.as_dvec3());
            let (mut expected, mut bound, mut unclear) = (DVec3::ZERO, 1e-6, false);
            for light in &world.lights {
                let (to_light, irradiance) = sent(light, at);
                let wi = local(normal, to_light);
                let above = to_light.dot(pixel.geometric_normal.as_dvec3());
                unclear |= above.abs().min(wi.z.abs()) < 1e-5;
                if above <= 0.0 || wi.z <= 0.0 {
                    continue;
                }
                let distance = match *light {
                    Light::Point { position, .. } | Light::Spot { position, .. } => {
                        (position.as_dvec3() - at).length()
                    }
                    _ => f64::INFINITY,
                };
                let (hidden, margin) = hidden_by_screens(at, to_light, distance);
                unclear |= margin < 1e-3;
                if hidden {
                    n_hidden += 1;
                    continue;
                }
                let (specular, _) = material.evaluate(wo, wi);
                let f = if pixel.lambert != 0 { pixel.albedo.as_dvec3() / PI } else { specular };
                let one = f * wi.z * irradiance;
                expected += one;
                let alpha = f64::from(pixel.roughness).powi(2);
                bound += (3e-5 + 3e-7 / (alpha * alpha)) * one.max_element();
            }
            if unclear {
                continue;
            }
            n_lit += usize::from(expected != DVec3::ZERO);
            let off = (texel.truncate().as_dvec3() - expected).largest();
            assert!(
                off <= bound && texel.w == 1.0,
                "{n_lights} lights, {size}, pixel {ix}, {pixel:?}: {texel}, expected {expected} to {bound:e}"
            );
        }
        assert!(
            n_lights == 0 || size == UVec2::new(8, 16) || n_lit > 10,
            "{size}: {n_lit}, {n_hidden}"
        );
    }
}

/// Radiance of the pixels, from a target that held poison; nothing is rejected.
fn run_direct(
    kernel: &ComputeKernel,
    scene: &GpuScene,
    picture: &Picture,
    [n_light_samples, n_bsdf_samples]: [u32; 2],
    faults: (u32, u32),
) -> Vec<Vec4> {
    let radiance = target(picture.size());
    let counts = storage(bytemuck::cast_slice(&[0u32, 0, 0xabcd, 0xabcd]));
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .scene(scene.group())
            .uniform("settings", &UVec4::new(n_light_samples, n_bsdf_samples, 0, 0))
            .bind("direct", &radiance)
            .bind("faults", &counts)
            .with(picture.bindings())
            .dispatch(Dispatch::Area(picture.size()));
    });
    let counts: Vec<u32> = bytemuck::pod_collect_to_vec(&read(&counts));
    assert_eq!(counts, [faults.0, faults.1, 0xabcd, 0xabcd], "rejected and cut pixels, two guards");
    texels(&radiance)
}

/// Light that is not finite becomes black, and is counted: ten suns of 3e38 W/m² are more than f32 holds where all of it
/// is reflected. Tolerance elsewhere: ten additions, as for any light.
#[test]
fn direct_light_that_is_not_finite_is_counted() {
    let sun = Light::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::splat(3e38) };
    let scene = on_gpu(&far_triangle(vec![sun; 10]));
    let kernel = ComputeKernel::new(gpu(), scene.shaders(), Some(scene.group()), "frame/direct");
    let picture = Picture::new(UVec2::new(9, 3), |pixel| PixelRecord {
        geometric_normal: Vec3::Y,
        shading_normal: Vec3::Y,
        to_viewer: Vec3::Y,
        albedo: Vec3::splat(if pixel.x % 4 == 1 { 1.0 } else { 0.25 }),
        is_surface: 1,
        lambert: 1,
        ..PixelRecord::zeroed()
    });
    let found = run_direct(&kernel, &scene, &picture, [1, 1], (2 * 3, 0));
    for (ix, texel) in found.iter().enumerate() {
        let expected = if ix % 9 % 4 == 1 { 0.0 } else { 7.5e38 / PI };
        let off = (f64::from(texel.x) - expected).abs();
        assert!(off <= 1e-6 * expected, "pixel {ix}: {texel}, expected {expected:e} to 1e-6 of it");
    }
}
