// SPDX-License-Identifier: MIT OR Apache-2.0
//! Shadow maps: their geometry in f64, and penumbras by closed forms, over made-up surfaces.

use crate::harness::{Random, gpu, map, submit};
use crate::picture::{Picture, PixelRecord, pixel_module, target, texels};
use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, UVec2, UVec4, Vec2, Vec3};
use lucerna::components::shadow_maps::{ShadowFiltering, ShadowMaps, ShadowSettings};
use lucerna::gpu::{ComputeKernel, Dispatch};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Instance, Light, Material, Mesh, Scene};
use lucerna::seam::SceneSeam;
use lucerna::settings;
use std::f64::consts::PI;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Look {
    position: Vec3,
    half_width: f32,
    right: Vec3,
    near: f32,
    up: Vec3,
    range: f32,
    forward: Vec3,
    step: f32,
    at: Vec3,
    size: f32,
    normal: Vec3,
    light_size: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Looked {
    plane: Vec2,
    z: f32,
    depth: f32,
    gradient: Vec2,
    map: Vec2,
    clip: glam::Vec4,
    back: f32,
    texel: f32,
    penumbra: f32,
    reserved: f32,
}

fn look(inputs: &[Look]) -> Vec<Looked> {
    map(
        "#import lucerna::components::shadow_maps::shadow_map::{ShadowView, shadow_point, shadow_depth, shadow_clip}
         #import lucerna::components::shadow_maps::shadow_map::{distance_of_depth, texel_width, map_coordinates, penumbra_radius}
         struct Input {
             position: vec3<f32>, half_width: f32, right: vec3<f32>, near: f32, up: vec3<f32>, range: f32,
             forward: vec3<f32>, step: f32, at: vec3<f32>, size: f32, normal: vec3<f32>, light_size: f32,
         }
         struct Output {
             plane: vec2<f32>, z: f32, depth: f32, gradient: vec2<f32>, map: vec2<f32>, clip: vec4<f32>,
             back: f32, texel: f32, penumbra: f32, reserved: f32,
         }
         fn map(x: Input) -> Output {
             let view = ShadowView(x.position, 0u, x.right, x.half_width, x.up, x.near, x.forward, x.range);
             let found = shadow_point(view, x.at, x.normal);
             let depth = shadow_depth(view, found.z);
             return Output(
                 found.plane, found.z, depth, found.gradient, map_coordinates(view, found.plane),
                 shadow_clip(view, x.at), distance_of_depth(view, depth), texel_width(view, found.z, x.size),
                 penumbra_radius(view, x.light_size, 0.7 * found.z, found.z), 0.0,
             );
         }",
        inputs,
    )
}

/// What a view sees of points and planes: coordinates, reversed depth, where in the map, and how the depth of the
/// surface's plane changes over the coordinates, there by a difference in f64 over the plane itself. Tolerance: 30
/// roundings; of the difference 1e-3; depths are good to 6e-8 of 1.
#[test]
fn views_see_points_and_planes_as_in_f64() {
    let mut random = Random(91);
    let inputs: Vec<Look> = (0..4000)
        .map(|ix| {
            let forward = random.direction();
            let (right, up) = forward.any_orthonormal_pair();
            let normal = if ix % 21 == 0 {
                // A view of parallel rays, 2.9 to 3.4° above the surface: the slope ends at 2.87°.
                let facing = random.range(0.0502, 0.06);
                (1.0 - facing * facing).sqrt() * right - facing * forward
            } else {
                loop {
                    let normal = random.direction();
                    // Up to 72° from the light.
                    if normal.dot(forward) < -0.3 {
                        break normal;
                    }
                }
            };
            let position = 3.0 * random.direction();
            let half_width = random.range(0.3, 1.2);
            let (x, y) = (random.range(-0.2, 0.2), random.range(-0.2, 0.2));
            let z = random.range(0.5, 9.0);
            let parallel = ix % 3 == 0;
            let across = if parallel { right * x + up * y } else { (right * x + up * y) * z };
            Look {
                position,
                half_width,
                right,
                near: random.range(0.01, 0.3),
                up,
                range: if parallel { random.range(10.0, 20.0) } else { 0.0 },
                forward,
                step: 0.0,
                at: position + forward * z + across,
                size: 2f32.powi(ix % 5 + 6),
                normal,
                light_size: random.range(0.01, 0.5),
            }
        })
        .collect();
    for (input, found) in inputs.iter().zip(look(&inputs)) {
        let axes = [input.right, input.up, input.forward].map(|axis| axis.as_dvec3());
        let (near, range) = (f64::from(input.near), f64::from(input.range));
        let parallel = range > 0.0;
        // x, y of the plane at distance 1 (or of space), z, and depth.
        let seen = |at: DVec3| {
            let offset = at - input.position.as_dvec3();
            let z = offset.dot(axes[2]);
            let across = DVec2::new(offset.dot(axes[0]), offset.dot(axes[1]));
            if parallel { (across, z, 1.0 - (z - near) / range) } else { (across / z, z, near / z) }
        };
        let at = input.at.as_dvec3();
        let (plane, z, depth) = seen(at);
        let half = f64::from(input.half_width);
        let near_to = |found: f32, expected: f64, bound: f64, quantity: &str| {
            let off = (f64::from(found) - expected).abs();
            assert!(
                off <= bound,
                "{quantity}: {found}, expected {expected} to {bound:e}; {input:?}"
            );
        };
        near_to(found.plane.x, plane.x, 4e-6, "x in the plane");
        near_to(found.plane.y, plane.y, 4e-6, "y in the plane");
        near_to(found.z, z, 4e-6, "distance [m]");
        near_to(found.depth, depth, 4e-6, "reversed depth");
        near_to(
            found.back,
            z,
            4e-6 * z * (1.0 + z / near) / 9.0 + 4e-6 * range,
            "distance of the depth",
        );
        near_to(found.map.x, 0.5 + 0.5 * plane.x / half, 8e-6, "u");
        near_to(found.map.y, 0.5 - 0.5 * plane.y / half, 8e-6, "v");
        let w = if parallel { 1.0 } else { z };
        near_to(found.clip.w, w, 4e-6, "clip w");
        near_to(found.clip.x / found.clip.w, plane.x / half, 2e-5, "clip x");
        near_to(found.clip.y / found.clip.w, plane.y / half, 2e-5, "clip y");
        near_to(found.clip.z / found.clip.w, depth, 4e-6, "clip depth");
        let texel = 2.0 * half / f64::from(input.size) * w;
        near_to(found.texel, texel, 1e-5 * texel, "width of a texel [m]");
        let blocker = 0.7 * z;
        let light = f64::from(input.light_size);
        let radius = if parallel { z - blocker } else { 1.0 / blocker - 1.0 / z };
        near_to(
            found.penumbra,
            light * radius,
            1e-5 * light * radius.max(1.0),
            "radius of the penumbra",
        );
        // Along the surface's plane, the depth by the coordinates.
        let (u, v) = input.normal.as_dvec3().any_orthonormal_pair();
        let h = 1e-5;
        let [along_u, along_v] = [u, v].map(|step| {
            let (ahead, behind) = (seen(at + h * step), seen(at - h * step));
            (ahead.0 - behind.0, ahead.2 - behind.2)
        });
        for (step, change) in [along_u, along_v] {
            let expected = change / step.length();
            let direction = step / step.length();
            let gradient = found.gradient.as_dvec2().dot(direction);
            let bound = 1e-3 * found.gradient.as_dvec2().length() + 1e-6;
            near_to(gradient as f32, expected, bound, "slope of the plane's depth");
        }
    }
}

/// The 32 taps are spread evenly over the unit disc: their moments are the disc's, ∫r² = ½ and ∫x = ∫xy = 0, to 2 %.
#[test]
fn taps_cover_the_disc_evenly() {
    let inputs: Vec<[f32; 4]> =
        (0..320).map(|ix| [(ix % 32) as f32, 0.2 * (ix / 32) as f32, 0.0, 0.0]).collect();
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::components::shadow_maps::shadow_map::disc_tap
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(disc_tap(u32(x.x), x.y), 0.0, 0.0); }",
        &inputs,
    );
    for (turn, taps) in found.chunks_exact(32).enumerate() {
        let mean = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            taps.iter().map(|tap| f(tap[0].into(), tap[1].into())).sum::<f64>() / 32.0
        };
        for (what, expected, found) in [
            ("x", 0.0, mean(&|x, _| x)),
            ("y", 0.0, mean(&|_, y| y)),
            ("r²", 0.5, mean(&|x, y| x * x + y * y)),
            ("x²", 0.25, mean(&|x, _| x * x)),
            ("xy", 0.0, mean(&|x, y| x * y)),
            ("r⁴", 1.0 / 3.0, mean(&|x, y| (x * x + y * y).powi(2))),
        ] {
            assert!(
                (found - expected).abs() < 0.02,
                "turn {turn}: mean {what} {found:.4}, expected {expected:.4} to 0.02"
            );
        }
        // The first tap is at √(½/32) along the turn.
        let radius = (0.5f64 / 32.0).sqrt();
        let angle = 0.2 * turn as f64;
        let first = DVec2::new(angle.cos(), angle.sin()) * radius;
        let off = (DVec2::new(taps[0][0].into(), taps[0][1].into()) - first).length();
        assert!(off < 1e-5, "turn {turn}: first tap {:?}, expected {first} to 1e-5", taps[0]);
    }
}

/// Share of a disc of radius 1 beyond a line at the distance u from its middle.
fn disc_beyond(u: f64) -> f64 {
    let u = u.clamp(-1.0, 1.0);
    (u.acos() - u * (1.0 - u * u).sqrt()) / PI
}

/// A point light of radius R = 0.5 m whose six views meet at 45°, a strip at the distance 1 that runs along the border of two
/// views, and receivers at the distance 2 on the near side of that border. A disc of R·(1/1 − 1/2) = 0.25 around a receiver
/// sees the strip's share; near the border the disc shrinks to what the view holds, 0.1 beyond it, which costs 0.04 here
/// (from the difference of discs cut there). What lies beyond must not be taken from the view's last texels: without
/// shrinking it is 0.1 to 0.19 too dark.
#[test]
fn penumbras_stay_within_a_cubes_views() {
    const SIZE: UVec2 = UVec2::new(11, 16);
    let (low, high) = (1.05, 1.12);
    for face in 0..6 {
        for side in 0..4 {
            let axis = face / 2;
            let forward = Vec3::AXES[axis] * if face % 2 == 0 { 1.0 } else { -1.0 };
            let across =
                Vec3::AXES[(axis + 1 + side / 2) % 3] * if side % 2 == 0 { 1.0 } else { -1.0 };
            let along = forward.cross(across);
            let at = |u: f32, v: f32| forward + across * u + along * v;
            let strip = Mesh {
                positions: vec![at(low, -4.0), at(high, -4.0), at(high, 4.0), at(low, 4.0)],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                ..Mesh::default()
            };
            let world = Scene {
                meshes: vec![strip],
                instances: vec![Instance { mesh: 0, world_from_object: glam::Affine3A::IDENTITY }],
                materials: vec![Material { double_sided: true, ..Material::default() }],
                lights: vec![Light::Point {
                    position: Vec3::ZERO,
                    intensity: Vec3::ONE,
                    range: None,
                }],
                ..Scene::default()
            };
            let scene = GpuScene::new(gpu(), &world, GpuSceneOptions::default())
                .unwrap()
                .with_module(pixel_module());
            let filtering = ShadowFiltering::Pcss { light_radius: 0.5, angular_radius: 0.5 };
            let shadows = settings!(ShadowSettings { resolution: 256, filtering });
            let mut maps = ShadowMaps::new(gpu(), &scene, shadows).unwrap();
            submit(|recorder| maps.record(recorder, &scene)).unwrap();
            let visibility = maps.visibility();
            let shaders =
                scene.shaders().with_variant(visibility.variant(scene.shaders().variant()));
            let kernel = ComputeKernel::new(gpu(), &shaders, Some(scene.group()), "frame/direct");
            let place = |pixel: UVec2| (0.9 + 0.009 * pixel.x as f32, 0.04 * pixel.y as f32 - 0.3);
            let picture = Picture::new(SIZE, |pixel| {
                let (u, v) = place(pixel);
                let position = 2.0 * at(u, v);
                let normal = -position.normalize();
                PixelRecord {
                    position,
                    geometric_normal: normal,
                    shading_normal: normal,
                    to_viewer: normal,
                    // So that all of the light is π/π.
                    albedo: Vec3::ONE,
                    is_surface: 1,
                    lambert: 1,
                    ..PixelRecord::zeroed()
                }
            });
            let light = target(SIZE);
            let faults = crate::harness::storage(&[0; 16]);
            submit(|recorder| {
                kernel
                    .call(&mut recorder.compute("test"))
                    .scene(scene.group())
                    .uniform("settings", &UVec4::new(1, 0, 0, 0))
                    .bind("direct", &light)
                    .bind("faults", &faults)
                    .with(picture.bindings())
                    .with(visibility.bindings())
                    .dispatch(Dispatch::Area(SIZE));
            });
            let found = texels(&light);
            for x in 0..SIZE.x {
                let (u, _) = place(UVec2::new(x, 0));
                // Rows average the pattern of the filter.
                let seen: f64 = (0..SIZE.y)
                    .map(|y| {
                        let ix = (y * SIZE.x + x) as usize;
                        let distance = picture.records[ix].position.as_dvec3().length();
                        f64::from(found[ix].x) * PI * distance * distance / f64::from(SIZE.y)
                    })
                    .sum();
                let of = |border: f32| disc_beyond(f64::from(border - u) / 0.25);
                let expected = 1.0 - (of(low) - of(high));
                assert!(
                    (seen - expected).abs() < 0.06,
                    "view {face}, border {side}, receiver at {u:.3}: {seen:.3} of the light, expected {expected:.3} to 0.06"
                );
            }
        }
    }
}
