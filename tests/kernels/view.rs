// SPDX-License-Identifier: MIT OR Apache-2.0
//! The camera's functions of a frame: `camera/primary_ray`, `frame/view`, `frame/gbuffer`, `frame/pixel_on_triangle`.

use crate::harness::{KeepNan, Largest, Random, map};
use crate::picture::{above, color};
use bytemuck::{Pod, Zeroable};
use glam::{DMat4, DVec2, DVec3, DVec4, UVec2, UVec4, Vec2, Vec3, Vec4};
use lucerna::frame::{FrameView, ShaderCamera};
use lucerna::settings;

/// A random camera, perspective or parallel.
fn random_camera(random: &mut Random, parallel: bool) -> ShaderCamera {
    let forward = random.direction();
    let (right, up) = forward.any_orthonormal_pair();
    let turn = random.range(0.0, 6.0);
    let (x, y) = (right * turn.cos() + up * turn.sin(), up * turn.cos() - right * turn.sin());
    settings!(ShaderCamera {
        position: 5.0 * random.direction(),
        orthographic: u32::from(parallel),
        forward,
        right: x * random.range(0.3, 2.0),
        up: y * random.range(0.3, 2.0),
        ..Zeroable::zeroed()
    })
}

/// World to clip space, without jitter: (x, y, near, z) in the camera's axes; of parallel rays depth falls from 1 on the
/// near plane.
fn clip_from_world(camera: &ShaderCamera, near: f64, inverse_range: f64) -> DMat4 {
    let position = camera.position.as_dvec3();
    let row = |axis: DVec3| axis.extend(-axis.dot(position));
    let of = |axis: Vec3| row(axis.as_dvec3() / axis.as_dvec3().length_squared());
    let z = row(camera.forward.as_dvec3());
    let (depth, w) = match camera.orthographic {
        0 => (DVec4::W * near, z),
        _ => (DVec4::W * (1.0 + near * inverse_range) - z * inverse_range, DVec4::W),
    };
    DMat4::from_cols(of(camera.right), of(camera.up), depth, w).transpose()
}

fn random_view(random: &mut Random, parallel: bool) -> FrameView {
    let camera = random_camera(random, parallel);
    let previous = random_camera(random, parallel);
    let (near, inverse_range) = (random.range(0.01, 0.2), random.range(0.02, 0.1));
    let of = |camera: &ShaderCamera| clip_from_world(camera, near.into(), inverse_range.into());
    settings!(FrameView {
        camera,
        clip_from_world: of(&camera).as_mat4(),
        world_from_clip: of(&camera).inverse().as_mat4(),
        previous_clip_from_world: of(&previous).as_mat4(),
        size: UVec2::new(random.bits() as u32 % 90 + 1, random.bits() as u32 % 90 + 1),
        jitter: Vec2::new(random.range(-0.5, 0.5), random.range(-0.5, 0.5)),
        near,
        inverse_range,
        emission_scale: 2f32.powi(random.bits() as i32 % 20),
        ..Zeroable::zeroed()
    })
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Seen {
    view: FrameView,
    position: Vec4,
    pixel: UVec4,
}

/// The point of the picture in which a camera sees a position, and the distance along its axis.
fn seen(camera: &ShaderCamera, position: DVec3) -> (DVec2, f64) {
    let offset = position - camera.position.as_dvec3();
    let z = offset.dot(camera.forward.as_dvec3());
    let on = |axis: Vec3| offset.dot(axis.as_dvec3()) / axis.as_dvec3().length_squared();
    let scale = if camera.orthographic != 0 { 1.0 } else { z };
    let (x, y) = (on(camera.right) / scale, on(camera.up) / scale);
    (DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y), z)
}

/// What a frame sees, and where, against f64: rays, points at a depth, clip space with and without jitter, and motion.
/// Tolerance: 40 roundings of coordinates up to 40 m, over the pinhole's distance.
#[test]
fn views_project_as_in_f64() {
    let mut random = Random(120);
    let inputs: Vec<Seen> = (0..4000)
        .map(|ix| {
            let view = random_view(&mut random, ix % 3 == 0);
            let camera = view.camera;
            let (x, y) = (random.range(-1.0, 1.0), random.range(-1.0, 1.0));
            // Some are behind the camera of the frame before, most are before it.
            let z = random.range(0.5, 20.0);
            let scale = if camera.orthographic != 0 { 1.0 } else { z };
            let position =
                camera.position + camera.forward * z + (camera.right * x + camera.up * y) * scale;
            let pixel = UVec4::new(
                random.bits() as u32 % view.size.x,
                random.bits() as u32 % view.size.y,
                0,
                0,
            );
            Seen { view, position: position.extend(z), pixel }
        })
        .collect();
    let found: Vec<[Vec4; 5]> = map(
        "#import lucerna::frame::view::{FrameView, clip_position, motion_at, picture_from_clip, sampled_point, view_direction}
         #import lucerna::camera::primary_ray::{point_at_depth, primary_ray}
         struct Input { view: FrameView, position: vec4<f32>, pixel: vec4<u32> }
         struct Output { clip: vec4<f32>, points: vec4<f32>, direction: vec4<f32>, at_depth: vec4<f32>, origin: vec4<f32> }
         fn map(x: Input) -> Output {
             let clip = clip_position(x.view, x.position.xyz);
             let point = sampled_point(x.view, x.pixel.xy);
             let motion = motion_at(x.view, x.position.xyz, point);
             return Output(
                 clip, vec4<f32>(point, motion), vec4<f32>(view_direction(x.view, x.pixel.xy), 0.0),
                 vec4<f32>(point_at_depth(x.view.camera, point, x.position.w), picture_from_clip(clip).x),
                 vec4<f32>(primary_ray(x.view.camera, point).origin, picture_from_clip(clip).y),
             );
         }",
        &inputs,
    );
    let (mut n_behind, mut n_clamped) = (0, 0);
    for (ix, (input, [clip, points, direction, at_depth, origin])) in
        inputs.iter().zip(&found).enumerate()
    {
        let (view, camera) = (&input.view, &input.view.camera);
        let parallel = camera.orthographic != 0;
        let what = format!("input {ix}, parallel {parallel}");
        let near = |found: Vec3, expected: DVec3, bound: f64, quantity: &str| {
            let off = (found.as_dvec3() - expected).largest();
            assert!(off <= bound, "{what}: {quantity} {found}, expected {expected} to {bound:e}");
        };
        let (size, jitter) = (view.size.as_dvec2(), view.jitter.as_dvec2());
        let position = input.position.truncate().as_dvec3();
        // The middle of a pixel sees what is `jitter` away from it.
        let (point, z) = seen(camera, position);
        let seen_at = point - jitter / size;
        near(
            Vec3::new(at_depth.w, origin.w, 0.0),
            seen_at.extend(0.0),
            1e-4,
            "picture of the clip position",
        );
        let depth = match parallel {
            true => 1.0 - (z - f64::from(view.near)) * f64::from(view.inverse_range),
            false => f64::from(view.near) / z,
        };
        let found_depth = f64::from(clip.z / clip.w);
        assert!(
            (found_depth - depth).abs() < 1e-5,
            "{what}: depth {found_depth}, expected {depth} to 1e-5"
        );
        let sampled = (input.pixel.truncate().truncate().as_dvec2() + 0.5 + jitter) / size;
        near(points.truncate().with_z(0.0), sampled.extend(0.0), 1e-6, "sampled point");
        let offset = camera.right.as_dvec3() * (2.0 * sampled.x - 1.0)
            + camera.up.as_dvec3() * (1.0 - 2.0 * sampled.y);
        let forward = camera.forward.as_dvec3();
        let (start, along) = match parallel {
            true => (camera.position.as_dvec3() + offset, forward),
            false => (camera.position.as_dvec3(), (forward + offset).normalize()),
        };
        near(direction.truncate(), along, 1e-6, "direction");
        near(origin.truncate(), start, 3e-6, "origin");
        let distance = f64::from(input.position.w);
        let expected = match parallel {
            true => start + forward * distance,
            false => start + (forward + offset) * distance,
        };
        near(at_depth.truncate(), expected, 3e-5, "point at a depth");
        // The matrix of the frame before, as f32.
        let before = view.previous_clip_from_world.as_dmat4() * position.extend(1.0);
        let motion = DVec2::new(points.z.into(), points.w.into());
        let expected = if before.w > 0.0 {
            let place =
                DVec2::new(0.5 + 0.5 * before.x / before.w, 0.5 - 0.5 * before.y / before.w);
            (place - sampled).clamp(DVec2::splat(-4.0), DVec2::splat(4.0))
        } else {
            DVec2::splat(4.0)
        };
        n_behind += usize::from(before.w <= 0.0);
        n_clamped += usize::from(before.w > 0.0 && expected.abs().max_element() == 4.0);
        if before.w.abs() > 0.5 {
            let bound = 1e-4 + 1e-4 / before.w.abs().powi(2);
            let off = (motion - expected).largest();
            assert!(off <= bound, "{what}: motion {motion}, expected {expected} to {bound:e}");
        }
    }
    assert!(n_behind > 300 && n_clamped > 50, "{n_behind} behind, {n_clamped} clamped");
}

/// What the G-buffer's texels keep of a surface: base colour, metallic, roughness and depth as they are; normals to 6.5e-5
/// rad; emission scaled, and at most 65 504 of it; the position to the bound that it states, and that bound is a 1/256 of a
/// pixel and some roundings. A depth of 0 is no surface.
#[test]
fn texels_keep_the_surface() {
    let mut random = Random(121);
    #[repr(C)]
    #[derive(Clone, Copy, Debug, Pod, Zeroable)]
    struct Kept {
        view: FrameView,
        base_color: Vec3,
        metallic: f32,
        shading_normal: Vec3,
        roughness: f32,
        geometric_normal: Vec3,
        depth: f32,
        emission: Vec3,
        pixel: u32,
    }
    let inputs: Vec<Kept> = (0..3000)
        .map(|ix| {
            let mut view = random_view(&mut random, ix % 3 == 0);
            (view.lambert, view.irradiance) = (u32::from(ix % 5 == 1), u32::from(ix % 7 == 1));
            let geometric_normal = random.direction();
            Kept {
                view,
                base_color: color(&mut random),
                metallic: random.unit(),
                shading_normal: above(&mut random, geometric_normal),
                roughness: random.unit(),
                geometric_normal,
                depth: random.range(0.5, 30.0),
                emission: color(&mut random) * 2f32.powf(random.range(-6.0, 12.0)),
                pixel: (random.bits() as u32 % view.size.x)
                    | ((random.bits() as u32 % view.size.y) << 16),
            }
        })
        .collect();
    let found: Vec<[Vec4; 9]> = map(
        "#import lucerna::frame::gbuffer::{GBufferTexels, decode_gbuffer, encode_gbuffer}
         #import lucerna::frame::view::FrameView
         struct Input {
             view: FrameView, base_color: vec3<f32>, metallic: f32, shading_normal: vec3<f32>, roughness: f32,
             geometric_normal: vec3<f32>, depth: f32, emission: vec3<f32>, pixel: u32,
         }
         struct Output {
             position: vec4<f32>, error: vec4<f32>, shading: vec4<f32>, geometric: vec4<f32>, albedo: vec4<f32>,
             base: vec4<f32>, emission: vec4<f32>, to_viewer: vec4<f32>, none: vec4<f32>,
         }
         fn map(x: Input) -> Output {
             let texels = encode_gbuffer(x.view, x.base_color, x.metallic, x.roughness, x.shading_normal,
                 x.geometric_normal, x.emission, x.depth);
             let pixel = vec2<u32>(x.pixel & 0xffffu, x.pixel >> 16u);
             let found = decode_gbuffer(x.view, pixel, texels);
             var empty = texels;
             empty.depth = 0.0;
             let none = decode_gbuffer(x.view, pixel, empty);
             return Output(
                 vec4<f32>(found.position, found.depth), vec4<f32>(found.position_error, f32(found.is_surface)),
                 vec4<f32>(found.shading_normal, f32(found.lambert)), vec4<f32>(found.geometric_normal, found.roughness),
                 vec4<f32>(found.albedo, found.metallic), vec4<f32>(found.base_color, texels.depth),
                 vec4<f32>(found.emission, texels.emission.x), vec4<f32>(found.to_viewer, f32(none.is_surface)),
                 vec4<f32>(none.to_viewer, texels.emission.w),
             );
         }",
        &inputs,
    );
    for (ix, (input, out)) in inputs.iter().zip(&found).enumerate() {
        let [position, error, shading, geometric, albedo, base, emission, to_viewer, none] = *out;
        let (view, camera) = (&input.view, &input.view.camera);
        let what = format!("input {ix}: {out:?}");
        let near = |found: Vec3, expected: Vec3, bound: f32, quantity: &str| {
            let off = (found - expected).largest();
            assert!(off <= bound, "{quantity} {found}, expected {expected} to {bound:e}; {what}");
        };
        let pixel = UVec2::new(input.pixel & 0xffff, input.pixel >> 16);
        let sampled = (pixel.as_dvec2() + 0.5 + view.jitter.as_dvec2()) / view.size.as_dvec2();
        let offset = camera.right.as_dvec3() * (2.0 * sampled.x - 1.0)
            + camera.up.as_dvec3() * (1.0 - 2.0 * sampled.y);
        let (forward, depth) = (camera.forward.as_dvec3(), f64::from(input.depth));
        let parallel = camera.orthographic != 0;
        let scale = if parallel { 1.0 } else { depth };
        let expected = camera.position.as_dvec3() + forward * depth + offset * scale;
        near(position.truncate(), expected.as_vec3(), 5e-5, "position");
        // How far apart pixels are there, and 1/256 of it.
        let apart = 2.0
            * scale
            * (camera.right.as_dvec3().length() / f64::from(view.size.x))
                .max(camera.up.as_dvec3().length() / f64::from(view.size.y));
        let size = (expected - camera.position.as_dvec3()).length()
            + camera.position.as_dvec3().length()
            + scale * camera.right.as_dvec3().length();
        let bound = apart / 256.0 + 16.0 * 2f64.powi(-24) * size;
        for k in 0..3 {
            let off = (f64::from(error[k]) / bound - 1.0).abs();
            assert!(
                off < 1e-4,
                "bound of the position {}, expected {bound:e} to 1e-4 of it; {what}",
                error[k]
            );
        }
        let direction = if parallel { forward } else { (forward + offset).normalize() };
        near(to_viewer.truncate(), -direction.as_vec3(), 2e-6, "direction to the viewer");
        near(none.truncate(), -direction.as_vec3(), 2e-6, "direction to the viewer from the sky");
        assert_eq!([error.w, to_viewer.w], [1.0, 0.0], "surface, and none at depth 0; {what}");
        assert!(
            (position.w / input.depth - 1.0).abs() < 1e-6,
            "depth {}, expected {}; {what}",
            position.w,
            input.depth
        );
        let texel = view.near / input.depth;
        assert!(
            (base.w / texel - 1.0).abs() < 1e-6,
            "depth's texel {}, expected {texel}; {what}",
            base.w
        );
        near(shading.truncate(), input.shading_normal, 7e-5, "shading normal");
        near(geometric.truncate(), input.geometric_normal, 7e-5, "geometric normal");
        near(base.truncate(), input.base_color, 0.0, "base colour");
        let white = view.irradiance != 0;
        near(albedo.truncate(), if white { Vec3::ONE } else { input.base_color }, 0.0, "albedo");
        let lambert = f32::from(u8::from(white || view.lambert != 0));
        let rest = [albedo.w, geometric.w, none.w, shading.w];
        assert_eq!(
            rest,
            [input.metallic, input.roughness, input.roughness, lambert],
            "metallic, roughness twice, lambert; {what}"
        );
        let scaled = (input.emission * view.emission_scale).min(Vec3::splat(65504.0));
        assert_eq!(emission.w, scaled.x, "scaled emission; {what}");
        near(
            emission.truncate(),
            scaled / view.emission_scale,
            1e-6 * input.emission.max_element(),
            "emission",
        );
    }
}

/// A pixel's point on a triangle, and its change to the next pixel, against the plane's intersection with rays in f64.
/// Tolerance: 60 roundings of the corners' distance over the area that the camera sees; for the change the difference of
/// two such points, a tenth of a pixel apart.
#[test]
fn pixels_find_their_point_on_a_triangle() {
    let mut random = Random(122);
    #[repr(C)]
    #[derive(Clone, Copy, Debug, Pod, Zeroable)]
    struct On {
        camera: ShaderCamera,
        a: Vec4,
        b: Vec4,
        c: Vec4,
        /// x, y: the point of the picture; z, w: its size.
        point: Vec4,
    }
    let inputs: Vec<On> = (0..4000)
        .map(|ix| {
            let camera = random_camera(&mut random, ix % 3 == 0);
            let point = Vec2::new(random.unit(), random.unit());
            let offset = camera.right * (2.0 * point.x - 1.0) + camera.up * (1.0 - 2.0 * point.y);
            let z = random.range(1.0, 12.0);
            let through = match camera.orthographic {
                0 => camera.position + (camera.forward + offset) * z,
                _ => camera.position + offset + camera.forward * z,
            };
            // A triangle around the point, or one that it misses by a little.
            let [p, q] = [(); 2].map(|()| random.direction());
            let r = -p - q + 0.3 * random.direction();
            let away = if ix % 4 == 1 { 1.2 * p } else { Vec3::ZERO };
            let corner = |of: Vec3| (through + away + of).extend(0.0);
            let point = Vec4::new(point.x, point.y, 40.0, 30.0);
            On { camera, a: corner(p), b: corner(q), c: corner(r), point }
        })
        .collect();
    let found: Vec<[Vec4; 2]> = map(
        "#import lucerna::frame::pixel_on_triangle::pixel_on_triangle
         #import lucerna::camera::primary_ray::Camera
         struct Input { camera: Camera, a: vec4<f32>, b: vec4<f32>, c: vec4<f32>, point: vec4<f32> }
         struct Output { weights: vec4<f32>, spread: vec4<f32> }
         fn map(x: Input) -> Output {
             let found = pixel_on_triangle(x.camera, x.point.xy, x.point.zw, x.a.xyz, x.b.xyz, x.c.xyz);
             return Output(vec4<f32>(found.weights, 0.0, 0.0), found.spread);
         }",
        &inputs,
    );
    let (mut n_checked, mut n_outside, mut worst) = (0, 0, 0.0f64);
    for (ix, (input, [weights, spread])) in inputs.iter().zip(&found).enumerate() {
        let camera = &input.camera;
        let [a, b, c] = [input.a, input.b, input.c].map(|corner| corner.truncate().as_dvec3());
        let normal = (b - a).cross(c - a);
        let at = |point: DVec2| {
            let offset = camera.right.as_dvec3() * (2.0 * point.x - 1.0)
                + camera.up.as_dvec3() * (1.0 - 2.0 * point.y);
            let (start, direction) = match camera.orthographic {
                0 => (camera.position.as_dvec3(), camera.forward.as_dvec3() + offset),
                _ => (camera.position.as_dvec3() + offset, camera.forward.as_dvec3()),
            };
            let hit = start + direction * ((a - start).dot(normal) / direction.dot(normal)) - a;
            let square = normal.length_squared();
            DVec2::new(
                hit.cross(c - a).dot(normal) / square,
                (b - a).cross(hit).dot(normal) / square,
            )
        };
        let point = DVec2::new(input.point.x.into(), input.point.y.into());
        let exact = at(point);
        let hit = a + (b - a) * exact.x + (c - a) * exact.y;
        let along = match camera.orthographic {
            0 => (hit - camera.position.as_dvec3()).normalize(),
            _ => camera.forward.as_dvec3(),
        };
        let facing = (along.dot(normal) / normal.length()).abs();
        if facing < 0.2 || normal.length() < 0.3 {
            continue;
        }
        n_checked += 1;
        let three = DVec3::new(1.0 - exact.x - exact.y, exact.x, exact.y).max(DVec3::ZERO);
        n_outside += usize::from(exact.x < 0.0 || exact.y < 0.0 || exact.x + exact.y > 1.0);
        let expected = DVec2::new(three.y, three.z) / three.element_sum();
        let bound = 60.0 * 6e-8 * 20.0 / (facing * normal.length());
        let off = (DVec2::new(weights.x.into(), weights.y.into()) - expected).largest();
        worst = worst.max_nan(off / bound);
        assert!(
            off <= bound,
            "input {ix}: weights {weights}, expected {expected} to {bound:e}; {input:?}"
        );
        let step = |x: f64, y: f64| {
            10.0 * (at(point + DVec2::new(x, y) / (10.0 * DVec2::new(40.0, 30.0))) - exact)
        };
        let (right, down) = (step(0.5, 0.0) - step(-0.5, 0.0), step(0.0, 0.5) - step(0.0, -0.5));
        let expected = DVec4::new(right.x, right.y, down.x, down.y);
        let off = (spread.as_dvec4() - expected).largest();
        let bound = 100.0 * bound + 1e-2 * expected.largest();
        assert!(
            off <= bound,
            "input {ix}: change {spread}, expected {expected} to {bound:e}; {input:?}"
        );
    }
    println!("{n_checked} pixels, {n_outside} outside, at most {worst:.3} of the bound");
    assert!(n_checked > 1500 && n_outside > 150, "{n_checked} pixels, {n_outside} outside");
}
