// SPDX-License-Identifier: MIT OR Apache-2.0
//! The G-buffer against rays through the points that a frame samples, in f64.

use crate::harness::{Random, assert_each, gpu, map_with, read, storage, submit};
use crate::support::{add_texture, diffuse, floor, lambert, look_down, on_gpu, quad, scene};
use crate::whole::{Rendered, accumulated, read_texture, render};
use glam::{DVec2, DVec3, UVec2, Vec2, Vec3};
use lucerna::frame::{Pixels, View};
use lucerna::gpu::{ComputeKernel, Dispatch};
use lucerna::gpu_scene::{GpuScene, RaySource};
use lucerna::scene::{AlphaMode, Camera, Filter, Material, Mesh, Projection, Scene};
use lucerna::seam::SceneSeam;
use lucerna::techniques::reference::{Channel, resolve};

pub fn camera_at(eye: Vec3, target: Vec3, fov_degrees: f32) -> Camera {
    let forward = (target - eye).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    Camera {
        name: String::new(),
        position: eye,
        forward,
        up: right.cross(forward),
        projection: Projection::Perspective { vertical_fov: fov_degrees.to_radians() },
    }
}

/// Origin and direction of the ray through a place of the picture [pixels]; the direction's part along
/// the view axis is 1.
fn ray(camera: &Camera, size: UVec2, place: DVec2) -> (DVec3, DVec3) {
    let forward = camera.forward.as_dvec3();
    let right = forward.cross(camera.up.as_dvec3()).normalize();
    let up = right.cross(forward);
    let (half, is_parallel) = match camera.projection {
        Projection::Perspective { vertical_fov } => ((0.5 * f64::from(vertical_fov)).tan(), false),
        Projection::Orthographic { half_height } => (f64::from(half_height), true),
    };
    let aspect = f64::from(size.x) / f64::from(size.y);
    let p = 2.0 * place / size.as_dvec2() - 1.0;
    let offset = right * (p.x * half * aspect) - up * (p.y * half);
    let origin = camera.position.as_dvec3();
    if is_parallel { (origin + offset, forward) } else { (origin, forward + offset) }
}

pub fn center_ray(camera: &Camera, size: UVec2, x: u32, y: u32) -> (DVec3, DVec3) {
    ray(camera, size, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
}

/// Where the picture shows a point [0..1], and its distance along the view axis.
fn project(camera: &Camera, size: UVec2, point: DVec3) -> (DVec2, f64) {
    let forward = camera.forward.as_dvec3();
    let right = forward.cross(camera.up.as_dvec3()).normalize();
    let up = right.cross(forward);
    let offset = point - camera.position.as_dvec3();
    let z = offset.dot(forward);
    let (half, scale) = match camera.projection {
        Projection::Perspective { vertical_fov } => ((0.5 * f64::from(vertical_fov)).tan(), z),
        Projection::Orthographic { half_height } => (f64::from(half_height), 1.0),
    };
    let aspect = f64::from(size.x) / f64::from(size.y);
    let x = offset.dot(right) / (scale * half * aspect);
    let y = -offset.dot(up) / (scale * half);
    (DVec2::new(x, y) * 0.5 + 0.5, z)
}

struct Seen {
    triangle: usize,
    t: f64,
    weights: DVec2,
}

/// The nearest triangle on a ray, by brute force (Möller, Trumbore).
fn nearest(
    triangles: &[[DVec3; 3]],
    (origin, direction): (DVec3, DVec3),
    is_there: &dyn Fn(usize, DVec2) -> bool,
) -> Option<Seen> {
    let mut best: Option<Seen> = None;
    for (triangle, &[a, b, c]) in triangles.iter().enumerate() {
        let (e, f, s) = (b - a, c - a, origin - a);
        let det = e.dot(direction.cross(f));
        let u = s.dot(direction.cross(f)) / det;
        let v = direction.dot(s.cross(e)) / det;
        let t = f.dot(s.cross(e)) / det;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 1e-5;
        if inside && best.as_ref().is_none_or(|best| t < best.t) {
            let weights = DVec2::new(u, v);
            if is_there(triangle, weights) {
                best = Some(Seen { triangle, t, weights });
            }
        }
    }
    best
}

fn triangles_of(world: &Scene) -> Vec<[DVec3; 3]> {
    world
        .meshes
        .iter()
        .flat_map(|mesh| {
            mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize].as_dvec3()))
        })
        .collect()
}

/// What `decode_gbuffer` says of each pixel.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Decoded {
    /// w: position's error bound.
    position: [f32; 4],
    /// w: depth.
    geometric_normal: [f32; 4],
    /// w: metallic.
    shading_normal: [f32; 4],
    /// w: roughness.
    albedo: [f32; 4],
    emission: [f32; 4],
    to_viewer: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Texels {
    emission: [f32; 4],
    albedo: [f32; 4],
    normals: [u32; 2],
    pixel: [u32; 2],
    depth: f32,
    motion: [f32; 2],
    padding: f32,
}

fn half(bits: u16) -> f32 {
    let (sign, exponent, fraction) = (bits >> 15, (bits >> 10) & 31, bits & 1023);
    let magnitude = match exponent {
        0 => f32::from(fraction) * 2f32.powi(-24),
        31 => f32::INFINITY,
        e => (1.0 + f32::from(fraction) / 1024.0) * 2f32.powi(i32::from(e) - 15),
    };
    if sign == 1 { -magnitude } else { magnitude }
}

fn texels(found: &Rendered) -> Vec<Texels> {
    let gbuffer = &found.passes.gbuffer;
    let halves = |bytes: &[u8]| -> Vec<f32> {
        bytes.chunks_exact(2).map(|b| half(u16::from_le_bytes([b[0], b[1]]))).collect()
    };
    let albedo = read_texture(&gbuffer.albedo, 4);
    let normals: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&read_texture(&gbuffer.normals, 8));
    let emission = halves(&read_texture(&gbuffer.emission, 8));
    let motion = halves(&read_texture(&gbuffer.motion, 4));
    let depth: Vec<f32> = bytemuck::pod_collect_to_vec(&read_texture(&gbuffer.depth, 4));
    (0..depth.len())
        .map(|ix| {
            let linear = |k: usize| {
                lucerna::picture::srgb::linear_from_encoded(f64::from(albedo[4 * ix + k]) / 255.0)
                    as f32
            };
            Texels {
                emission: std::array::from_fn(|k| emission[4 * ix + k]),
                albedo: [linear(0), linear(1), linear(2), f32::from(albedo[4 * ix + 3]) / 255.0],
                normals: normals[ix],
                pixel: [ix as u32 % found.size.x, ix as u32 / found.size.x],
                depth: depth[ix],
                motion: std::array::from_fn(|k| motion[2 * ix + k]),
                padding: 0.0,
            }
        })
        .collect()
}

fn decode(view: &View, texels: &[Texels]) -> Vec<Decoded> {
    let uniform = crate::harness::uniform(bytemuck::bytes_of(view.data()));
    map_with(
        "#import lucerna::frame::gbuffer::{GBufferTexels, decode_gbuffer}
        #import lucerna::frame::view::FrameView
        struct Input {
            emission: vec4<f32>, albedo: vec4<f32>, normals: vec2<u32>, pixel: vec2<u32>,
            depth: f32, motion_x: f32, motion_y: f32, padding: f32,
        }
        struct Output {
            position: vec4<f32>, geometric_normal: vec4<f32>, shading_normal: vec4<f32>,
            albedo: vec4<f32>, emission: vec4<f32>, to_viewer: vec4<f32>,
        }
        @group(0) @binding(2) var<uniform> view: FrameView;
        fn map(in: Input) -> Output {
            let texels = GBufferTexels(in.albedo, in.normals, in.emission, in.depth);
            let s = decode_gbuffer(view, in.pixel, texels);
            return Output(
                vec4<f32>(s.position, s.position_error.x), vec4<f32>(s.geometric_normal, s.depth),
                vec4<f32>(s.shading_normal, s.metallic), vec4<f32>(s.albedo, s.roughness),
                vec4<f32>(s.emission, f32(s.is_surface)), vec4<f32>(s.to_viewer, 0.0),
            );
        }",
        texels,
        &[wgpu::BindGroupEntry { binding: 2, resource: uniform.as_entire_binding() }],
    )
}

fn xyz(v: [f32; 4]) -> DVec3 {
    Vec3::new(v[0], v[1], v[2]).as_dvec3()
}

/// Triangles of all sizes and turns with normals of their own, some of which shine, in front of a
/// floor that begins under the camera.
fn soup(center: Vec3) -> Scene {
    let mut random = Random(7);
    let mut materials = vec![lambert([1.0, 0.0, 1.0])];
    let mut meshes = vec![floor(40.0, 0.0, 0)];
    for k in 0..40 {
        let at = 3.0 * random.direction() + Vec3::Y;
        let extent = 10f32.powf(random.range(-1.0, 0.7));
        let positions: Vec<_> = (0..3).map(|_| at + extent * random.direction()).collect();
        let flat = (positions[1] - positions[0]).cross(positions[2] - positions[0]).normalize();
        let normals = (0..3).map(|_| (flat + 0.4 * random.direction()).normalize()).collect();
        materials.push(Material {
            emission: if k % 3 == 0 { Vec3::new(1.0 + k as f32, 2.0, 1e6) } else { Vec3::ZERO },
            double_sided: k % 6 == 0,
            metallic: (k % 2) as f32,
            roughness: 0.25 + 0.25 * (k % 4) as f32,
            // 0 and 1 are the same in 8 bits.
            ..lambert([(k & 1) as f32, ((k / 2) & 1) as f32, ((k / 4) & 1) as f32])
        });
        meshes.push(Mesh {
            positions,
            normals,
            triangles: vec![[0, 1, 2]],
            material: materials.len() - 1,
            ..Mesh::default()
        });
    }
    for mesh in &mut meshes {
        for position in &mut mesh.positions {
            *position += center;
        }
    }
    scene(meshes, materials)
}

/// Checks all pixels whose sampled point is farther than 1/50 of a pixel from any border (corners are snapped
/// to 1/256), and returns how many.
///
/// * Position: within its own error bound of the triangle's plane; along the ray, rounding of the
///   plane's equation over the cosine of incidence.
/// * Depth near/z: as the position, relative.
/// * Normals: 6.5e-5 rad of packing each in the scene and in the G-buffer, 2e-6 of interpolation.
/// * Base colour 0 and 1 and metallic 0 and 1: exact. Roughness in quarters: exact in 16 bits. Emission:
///   2⁻¹¹ relative, whatever its size (the dimmest here is 2⁻²⁸ of the brightest or more).
/// * Motion: 2⁻¹¹ relative, and 2e-6 of the picture.
fn check(what: &str, world: &Scene, camera: &Camera, previous: &Camera, size: UVec2) -> usize {
    let on_gpu = on_gpu(world, false, RaySource::Software);
    let mut found = render(&on_gpu, previous, size, accumulated(1, 0), 1);
    render_again(&mut found, &on_gpu, camera);
    let texels = texels(&found);
    let decoded = decode(&found.view, &texels);
    let triangles = triangles_of(world);
    let materials: Vec<usize> =
        world.meshes.iter().flat_map(|mesh| mesh.triangles.iter().map(|_| mesh.material)).collect();
    let normals: Vec<[DVec3; 3]> = world
        .meshes
        .iter()
        .flat_map(|mesh| {
            mesh.triangles.iter().map(|t| {
                let [a, b, c] = t.map(|v| mesh.positions[v as usize].as_dvec3());
                let flat = (b - a).cross(c - a).normalize();
                t.map(|v| mesh.normals.get(v as usize).map_or(flat, |n| n.as_dvec3()))
            })
        })
        .collect();
    let there = |_: usize, _: DVec2| true;
    let jitter = found.view.data().jitter.as_dvec2();
    assert!(
        jitter.abs().min_element() > 0.05,
        "{what}: the jitter is {jitter}, expected above 0.05 pixels along both axes"
    );
    let (mut n_checked, mut n_sky) = (0, 0);
    for (ix, (texel, seen)) in texels.iter().zip(&decoded).enumerate() {
        let place = DVec2::new(f64::from(texel.pixel[0]), f64::from(texel.pixel[1])) + 0.5 + jitter;
        let at = |x: f64, y: f64| {
            nearest(&triangles, ray(camera, size, place + DVec2::new(x, y) * 0.02), &there)
        };
        let expected = at(0.0, 0.0);
        let triangle = expected.as_ref().map(|seen| seen.triangle);
        let same = |x, y| at(x, y).map(|seen| seen.triangle) == triangle;
        if !(same(1.0, 1.0) && same(-1.0, 1.0) && same(1.0, -1.0) && same(-1.0, -1.0)) {
            continue;
        }
        let context = format!("{what}, pixel {ix} {:?}", texel.pixel);
        n_checked += 1;
        let (origin, direction) = ray(camera, size, place);
        let to_viewer = -direction.normalize();
        assert!(
            (xyz(seen.to_viewer) - to_viewer).length() < 1e-6,
            "{context}: direction to the viewer is {}, expected {to_viewer} within 1e-6",
            xyz(seen.to_viewer)
        );
        let Some(expected) = expected else {
            assert_eq!(texel.depth, 0.0, "{context}: a surface in the sky: its depth is not 0");
            assert_eq!(
                seen.emission[3], 0.0,
                "{context}: the sky is decoded as a surface, expected 0"
            );
            n_sky += 1;
            continue;
        };
        let [a, b, c] = triangles[expected.triangle];
        let flat = (b - a).cross(c - a).normalize();
        let front = flat.dot(direction) <= 0.0;
        let side = if front { 1.0 } else { -1.0 };
        let point = origin + direction * expected.t;
        let position = xyz(seen.position);
        let bound = f64::from(seen.position[3]) * flat.abs().element_sum();
        let off_plane = (position - a).dot(flat).abs();
        assert!(
            off_plane <= bound,
            "{context}: position {position} is {off_plane} off its triangle's plane, expected at most {bound}"
        );
        let cosine = flat.dot(direction.normalize()).abs();
        let extent = position.length()
            + expected.t * direction.length()
            + (b - a).length()
            + (c - a).length();
        let rounding = 16.0 * extent * 2f64.powi(-24) / cosine;
        let off = (position - point).length();
        assert!(
            off <= rounding,
            "{context}: position is {position}, expected {point}: off by {off}, expected at most {rounding}"
        );
        let depth = f64::from(found.view.data().near) / expected.t;
        let off = (f64::from(texel.depth) - depth).abs() / depth;
        assert!(
            off <= rounding / expected.t + 2e-7,
            "{context}: depth is {}, expected {depth}: off by {off:.2e} of it, expected at most {:.2e}",
            texel.depth,
            rounding / expected.t + 2e-7
        );

        let normal = xyz(seen.geometric_normal);
        assert!(
            (normal - side * flat).length() < 7e-5,
            "{context}: geometric normal is {normal}, expected {} within 7e-5",
            side * flat
        );
        let [na, nb, nc] = normals[expected.triangle];
        let w = expected.weights;
        let mut shading = (na * (1.0 - w.x - w.y) + nb * w.x + nc * w.y).normalize();
        if shading.dot(flat) < 0.0 {
            shading = -shading;
        }
        shading *= side;
        if shading.dot(to_viewer) < 0.0 {
            shading = -shading;
        }
        let away = (xyz(seen.shading_normal) - shading).length();
        // Interpolated normals of length 0.6 and more stretch the packing's error.
        assert!(
            shading.dot(to_viewer).abs() < 2e-4 || away < 2.2e-4 + 2.0 * rounding,
            "{context}: shading normal is {}, expected {shading}: off by {away}, expected below {}",
            xyz(seen.shading_normal),
            2.2e-4 + 2.0 * rounding
        );

        let material = &world.materials[materials[expected.triangle]];
        assert_eq!(
            xyz(seen.albedo),
            material.base_color.truncate().as_dvec3(),
            "{context}: the albedo is not the material's base colour"
        );
        assert_eq!(
            [seen.shading_normal[3], seen.albedo[3]],
            [material.metallic, material.roughness],
            "{context}: metallic and roughness are not the material's"
        );
        let shines = front || material.double_sided;
        let emission = if shines { material.emission } else { Vec3::ZERO };
        let off = (xyz(seen.emission) - emission.as_dvec3()).abs();
        assert!(
            (off - emission.as_dvec3() * 2f64.powi(-11)).max_element() <= 0.0,
            "{context}: emission is {}, expected {emission} within 2⁻¹¹ of it",
            xyz(seen.emission)
        );

        let (before, z) = project(previous, size, point);
        if z > 1e-3 {
            let motion =
                (before - place / size.as_dvec2()).clamp(DVec2::splat(-4.0), DVec2::splat(4.0));
            let found = Vec2::from(texel.motion).as_dvec2();
            let scale = if matches!(previous.projection, Projection::Orthographic { .. }) {
                1.0
            } else {
                z
            };
            let room = 2e-6 + motion.length() * 2f64.powi(-11) + 8.0 * rounding / scale;
            assert!(
                (found - motion).length() <= room,
                "{context}: motion is {found}, expected {motion} within {room:.2e}"
            );
        }
    }
    println!("{what}: {n_checked} pixels, {n_sky} of them sky");
    n_checked
}

/// Another frame from another camera, into the same targets.
fn render_again(found: &mut Rendered, world: &GpuScene, camera: &Camera) {
    let Rendered { passes, view, .. } = found;
    // Of two frames: with jitter.
    view.advance(world, camera, &accumulated(2, 0));
    let technique = &mut lucerna::techniques::NoIndirect;
    crate::harness::submit(|recorder| passes.record(recorder, world, view, technique)).unwrap();
}

#[test]
fn gbuffer_holds_what_rays_meet() {
    let size = UVec2::new(97, 61);
    let n_pixels = 97 * 61;
    let center = Vec3::new(0.0, 0.0, 0.0);
    let world = soup(center);
    let camera = camera_at(Vec3::new(1.0, 2.5, 7.0), Vec3::new(0.0, 1.0, 0.0), 65.0);
    let previous = camera_at(Vec3::new(1.3, 2.3, 6.5), Vec3::new(0.4, 1.1, 0.0), 60.0);
    let n_checked = check("perspective", &world, &camera, &previous, size);
    assert!(
        n_checked > n_pixels * 9 / 10,
        "perspective: {n_checked} of {n_pixels} pixels are checked, expected above 9/10 of them"
    );

    let parallel = |position: Vec3| Camera {
        position,
        projection: Projection::Orthographic { half_height: 3.0 },
        ..camera_at(Vec3::new(2.0, 3.0, 8.0), Vec3::ZERO, 1.0)
    };
    let (now, before) = (parallel(Vec3::new(2.0, 3.0, 8.0)), parallel(Vec3::new(2.2, 2.9, 8.1)));
    let n_checked = check("orthographic", &world, &now, &before, size);
    assert!(
        n_checked > n_pixels * 9 / 10,
        "orthographic: {n_checked} of {n_pixels} pixels are checked, expected above 9/10 of them"
    );

    // Low over the floor: the near plane cuts it.
    let low = camera_at(Vec3::new(0.0, 0.02, 8.0), Vec3::new(0.0, 0.3, 0.0), 90.0);
    let n_checked = check("low", &world, &low, &low, size);
    assert!(
        n_checked > n_pixels * 8 / 10,
        "low: {n_checked} of {n_pixels} pixels are checked, expected above 8/10 of them"
    );

    let away = Vec3::new(1000.0, 50.0, -700.0);
    let moved = |camera: &Camera| Camera { position: camera.position + away, ..camera.clone() };
    let n_checked = check("far away", &soup(away), &moved(&camera), &moved(&previous), size);
    assert!(
        n_checked > n_pixels * 9 / 10,
        "far away: {n_checked} of {n_pixels} pixels are checked, expected above 9/10 of them"
    );
}

/// 8 × 8 texels, every other one cut away; seen from above, holes show the floor below.
#[test]
fn masks_cut_holes() {
    let is_solid = |x: u32, z: u32| (x + z + x / 4).is_multiple_of(2);
    let rgba = (0..64).map(|ix| [255, 255, 255, if is_solid(ix % 8, ix / 8) { 255 } else { 0 }]);
    let mut world = scene(
        vec![floor(10.0, 0.0, 0), floor(1.0, 1.0, 1)],
        vec![lambert([0.0; 3]), lambert([1.0; 3])],
    );
    let texture = add_texture(&mut world, 8, rgba.collect());
    world.materials[1].base_color_texture = Some(texture);
    world.materials[1].alpha = AlphaMode::Mask { cutoff: 0.5 };
    let world = on_gpu(&world, true, RaySource::Software);
    let found = render(&world, &look_down(2.0, 1.0), UVec2::splat(24), accumulated(1, 0), 1);
    let depths = found.channel(Channel::Depth);
    for (ix, albedo) in found.channel(Channel::Albedo).into_iter().enumerate() {
        let is_solid = is_solid(ix as u32 % 24 / 3, ix as u32 / 72);
        assert_eq!(
            albedo,
            Vec3::splat(if is_solid { 1.0 } else { 0.0 }),
            "albedo of pixel {ix}, solid: {is_solid}"
        );
        let expected = if is_solid { 1.0 } else { 2.0 };
        assert!(
            (depths[ix].x - expected).abs() < 1e-6,
            "depth of pixel {ix} is {}, expected {expected} within 1e-6",
            depths[ix].x
        );
    }
}

/// A map of 45° along u turns the shading normal, and `diffuse_only` leaves it; packing 6.5e-5 each of
/// tangent, normal and result.
#[test]
fn normal_maps_turn_the_shading_normal() {
    let mut world = scene(vec![floor(2.0, 0.0, 0)], vec![lambert([1.0; 3])]);
    let texture = add_texture(&mut world, 1, vec![[218, 60, 218, 255]]);
    world.materials[0].normal_texture = Some(texture);
    let local = DVec3::new(218.0, 60.0, 218.0) * 2.0 / 255.0 - 1.0;
    // u is +X, the image's y is up, against v, which is +Z.
    let mapped = DVec3::new(local.x, local.z, -local.y).normalize();
    for (diffuse_only, expected) in [(false, mapped), (true, DVec3::Y)] {
        let world = on_gpu(&world, diffuse_only, RaySource::Software);
        let found = render(&world, &look_down(2.0, 1.0), UVec2::splat(4), accumulated(1, 0), 1);
        for seen in decode(&found.view, &texels(&found)) {
            assert!(
                (xyz(seen.shading_normal) - expected).length() < 2e-4,
                "diffuse only: {diffuse_only}: shading normal is {}, expected {expected} within 2e-4",
                xyz(seen.shading_normal)
            );
            assert!(
                (xyz(seen.geometric_normal) - DVec3::Y).length() < 1e-6,
                "diffuse only: {diffuse_only}: geometric normal is {}, expected {} within 1e-6",
                xyz(seen.geometric_normal),
                DVec3::Y
            );
        }
    }
}

/// A checker of single texels: near, its texels; from far, where a pixel holds 16 × 16 of them, their
/// mean, within 8 bits; and with many frames the footprint shrinks and jitter takes its place.
#[test]
fn textures_are_filtered_by_footprint() {
    let n = 64u32;
    let rgba = (0..n * n)
        .map(|ix| if (ix + ix / n).is_multiple_of(2) { [255; 4] } else { [0, 0, 0, 255] });
    let mut world = scene(vec![floor(1.0, 0.0, 0)], vec![lambert([1.0; 3])]);
    let texture = add_texture(&mut world, n, rgba.collect());
    world.materials[0].base_color_texture = Some(texture);
    world.textures[0].filter = Filter::Linear;
    let world = on_gpu(&world, true, RaySource::Software);
    let albedo = |size, n_frames| {
        render(&world, &look_down(2.0, 1.0), UVec2::splat(size), accumulated(n_frames, 0), 0)
            .channel(Channel::Albedo)
    };
    for (ix, pixel) in albedo(n, 1).into_iter().enumerate() {
        let (x, y) = (ix as u32 % n, ix as u32 / n);
        assert_eq!(
            pixel.x,
            if (x + y).is_multiple_of(2) { 1.0 } else { 0.0 },
            "albedo of the texel ({x}, {y}), seen from near"
        );
    }
    for pixel in albedo(4, 1) {
        // 188 of 255 in sRGB, rounded twice, and lavapipe's decoding (1.3e-3).
        assert!(
            (pixel.x - 0.5).abs() < 8e-3,
            "albedo from afar in one frame is {}, expected 0.5 within 8e-3",
            pixel.x
        );
    }
    for pixel in albedo(4, 64) {
        assert!(
            (pixel.x - 0.5).abs() < 0.06,
            "albedo from afar in 64 frames is {}, expected 0.5 within 0.06",
            pixel.x
        );
    }
}

/// Mips of oblong images keep at least a texel a side: from afar, 64 × 4 texels, the left half black and the right half
/// white, are black and white in four pixels a row, and so are 4 × 64 in four pixels a column.
#[test]
fn mips_of_oblong_textures_keep_a_texel_a_side() {
    for is_wide in [true, false] {
        let (width, height) = if is_wide { (64u32, 4u32) } else { (4, 64) };
        let rgba = (0..width * height).map(|ix| {
            let at = if is_wide { ix % width / 32 } else { ix / width / 32 };
            if at == 1 { [255; 4] } else { [0, 0, 0, 255] }
        });
        let mut world = scene(vec![floor(1.0, 0.0, 0)], vec![lambert([1.0; 3])]);
        let texture = add_texture(&mut world, width, rgba.collect());
        world.materials[0].base_color_texture = Some(texture);
        world.textures[0].filter = Filter::Linear;
        world.textures[0].wrap_u = lucerna::scene::Wrap::Clamp;
        world.textures[0].wrap_v = lucerna::scene::Wrap::Clamp;
        let world = on_gpu(&world, true, RaySource::Software);
        let camera = look_down(2.0, 1.0);
        let found = render(&world, &camera, UVec2::splat(4), accumulated(1, 0), 0);
        for (ix, pixel) in found.channel(Channel::Albedo).into_iter().enumerate() {
            let at = if is_wide { ix % 4 } else { ix / 4 };
            let expected = if at >= 2 { 1.0 } else { 0.0 };
            // A mip's texels lie within one half; 8 bits are exact for both.
            assert!(
                (pixel.x - expected).abs() < 1e-3,
                "{width} × {height} texels: albedo of pixel {ix} is {}, expected {expected} within 1e-3",
                pixel.x
            );
        }
    }
}

/// Frames with jitter have the box filter's mean: a quad's corner pixels by the share they cover. An R2
/// set of 64 points is off by at most (1 + log₂ 64)/64 for a half-plane, measured less.
#[test]
fn jitter_covers_the_pixel() {
    let corner = 4.0f32 / 3.0;
    let world = on_gpu(
        &scene(vec![floor(1.0, 0.0, 0)], vec![lambert([1.0; 3])]),
        true,
        RaySource::Software,
    );
    let found = render(&world, &look_down(3.0, corner), UVec2::splat(4), accumulated(64, 0), 1);
    for (ix, pixel) in found.channel(Channel::Albedo).into_iter().enumerate() {
        let share = [ix % 4, ix / 4].map(|k| if k == 0 || k == 3 { 0.5f32 } else { 1.0 });
        let expected = share[0] * share[1];
        assert!(
            (pixel.x - expected).abs() < 0.04,
            "albedo of pixel {ix} is {}, expected {expected} within 0.04",
            pixel.x
        );
    }
    // Without jitter each pixel is decided by its centre.
    let single =
        render(&world, &look_down(3.0, corner * 0.99), UVec2::splat(4), accumulated(1, 0), 1);
    assert_each(
        "albedo of pixels without jitter",
        &single.channel(Channel::Albedo),
        "1",
        |&pixel| pixel == Vec3::ONE,
    );
    let sums = resolve(&found.sums, found.size, Channel::Depth);
    assert_each("depth of pixels", &sums.rgb, "3 within 1e-5", |depth| {
        (depth.x - 3.0).abs() < 1e-5
    });
}

/// Quads behind one another at all distances: near/z orders them to the last.
#[test]
fn reversed_depth_orders_what_lies_far() {
    for distance in [1.0f32, 100.0, 1e4, 1e6] {
        let step = distance * 1e-5;
        let wall = |z: f32, material| {
            let s = 2.0 * distance;
            quad([[-s, -s, -z], [s, -s, -z], [s, s, -z], [-s, s, -z]], material)
        };
        for order in [[0, 1], [1, 0]] {
            let meshes = order.map(|k| wall(distance + step * k as f32, k)).to_vec();
            let world = scene(meshes, vec![lambert([1.0; 3]), lambert([0.0; 3])]);
            let world = on_gpu(&world, true, RaySource::Software);
            let camera = camera_at(Vec3::ZERO, Vec3::NEG_Z, 60.0);
            let found = render(&world, &camera, UVec2::splat(8), accumulated(1, 0), 1);
            assert_each(
                &format!("albedo of pixels at {distance} m, order {order:?}"),
                &found.channel(Channel::Albedo),
                "the nearer wall's 1",
                |&p| p == Vec3::ONE,
            );
            let near = f64::from(found.view.data().near);
            for texel in texels(&found) {
                let off = f64::from(texel.depth) / (near / f64::from(distance)) - 1.0;
                assert!(
                    off.abs() < 5e-7,
                    "{distance} m: depth is {}, expected {}: off by {off:.2e} of it, expected below 5e-7",
                    texel.depth,
                    near / f64::from(distance)
                );
            }
        }
    }
}

/// The seam's `pixel_surface` and `pixel_distance` read the G-buffer of their pixel: over a floor that ends within the
/// picture, both give the distance along the axis of view, and 0 and no surface beside it. Tolerance: the depth is near/z
/// in f32, both ways.
#[test]
fn the_pixel_seam_reads_its_pixel() {
    let world = scene(vec![floor(1.0, 0.0, 0)], vec![lambert([0.5; 3])]);
    let world = diffuse(&world);
    let size = UVec2::new(21, 13);
    let camera = camera_at(Vec3::new(0.4, 2.0, 1.5), Vec3::new(0.2, 0.0, 0.0), 60.0);
    let rendered = crate::whole::render(&world, &camera, size, accumulated(1, 0), 4);
    let shaders = world.shaders().with_module(lucerna::shader::Source {
        import_path: "lucerna::kernels::test::pixel".into(),
        file: "test.wgsl".into(),
        text: "
            #import lucerna::scene::pixel::{pixel_distance, pixel_surface, view}
            @group(1) @binding(0) var<storage, read_write> found: array<vec4<f32>>;
            @compute @workgroup_size(8, 8)
            fn main(@builtin(global_invocation_id) id: vec3<u32>) {
                if all(id.xy < view.size) {
                    let surface = pixel_surface(id.xy);
                    found[id.y * view.size.x + id.x] = vec4<f32>(
                        pixel_distance(id.xy), select(0.0, surface.depth, surface.is_surface),
                        surface.position.y, f32(surface.is_surface),
                    );
                }
            }"
        .into(),
    });
    let kernel = ComputeKernel::new(gpu(), &shaders, None, "test/pixel");
    let n = size.element_product() as usize;
    let found = storage(bytemuck::cast_slice(&vec![[-7.25f32; 4]; n]));
    let pixels = Pixels::new(&rendered.view, &rendered.passes.gbuffer).unwrap();
    submit(|recorder| {
        kernel
            .call(&mut recorder.compute("test"))
            .bind("found", &found)
            .with(pixels.bindings())
            .dispatch(Dispatch::Area(size));
    });
    let found: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&read(&found));
    let mut n_surfaces = 0;
    for (ix, &[distance, depth, height, is_surface]) in found.iter().enumerate() {
        let (x, y) = (ix as u32 % size.x, ix as u32 / size.x);
        let (origin, direction) = center_ray(&camera, size, x, y);
        let t = -origin.y / direction.y;
        let hit = origin + direction * t;
        let from_border = 1.0 - hit.x.abs().max(hit.z.abs());
        if from_border.abs() < 0.02 {
            continue;
        }
        let is_hit = t > 0.0 && from_border > 0.0;
        let along = direction.dot(camera.forward.as_dvec3());
        let expected = if is_hit { t * along } else { 0.0 };
        n_surfaces += usize::from(is_hit);
        for (what, found) in [("pixel_distance", distance), ("depth of pixel_surface", depth)] {
            let off = (f64::from(found) - expected).abs();
            assert!(
                off <= 2e-6 * expected,
                "{what} of pixel {x}, {y}: {found}, expected {expected} to 2e-6 of it"
            );
        }
        assert_eq!(is_surface, f32::from(u8::from(is_hit)), "surface of pixel {x}, {y}");
        assert!(height.abs() < 1e-5, "height of pixel {x}, {y}: {height}, expected 0 to 1e-5");
    }
    assert!(n_surfaces > 50 && n_surfaces < n - 20, "{n_surfaces} pixels of {n} see the floor");
}
