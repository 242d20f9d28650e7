// SPDX-License-Identifier: MIT OR Apache-2.0
//! `wgsl/texture` and the look-up of `wgsl/sky/equirectangular.wgsl`.

use crate::harness::{Largest, Random, gpu, map, map_with};
use glam::{DVec2, DVec3, Vec3, Vec4};
use std::f64::consts::TAU;
use wgpu::util::DeviceExt;

/// Walks to the texel one step after the other, turning or jumping at each border.
fn walk(texel: i32, size: i32, mode: u32) -> i32 {
    let (mut at, mut step) = (0, texel.signum());
    for _ in 0..texel.abs() {
        let next = at + step;
        at = match (mode, (0..size).contains(&next)) {
            (_, true) => next,
            (0, false) => (next + size) % size,
            (1, false) => {
                // Mirrored: the border's texel comes twice.
                step = -step;
                at
            }
            _ => at,
        };
    }
    at
}

/// Exact, for all texels within five periods of sizes 1 to 9, and far away by the period.
#[test]
fn texels_are_wrapped_as_a_walk_is() {
    let mut inputs = Vec::new();
    for mode in 0..3 {
        for size in 1..10 {
            inputs.extend((-5 * size..=5 * size).map(|texel| [texel, size, mode, texel]));
            for far in [-1_000_000, 1_000_000] {
                // Twice the size is every mode's period, and the edge stays the edge.
                inputs.push([2 * size * far + 3, size, mode, 3 + if mode == 2 { far } else { 0 }]);
            }
        }
    }
    let found: Vec<[i32; 1]> = map(
        "#import lucerna::texture::wrap::wrap_texel
         alias Input = vec4<i32>;
         struct Output { texel: i32 }
         fn map(x: Input) -> Output { return Output(wrap_texel(x.x, x.y, x.z == 1, x.z == 2)); }",
        &inputs,
    );
    for ([texel, size, mode, near], [found]) in inputs.iter().zip(found) {
        assert_eq!(found, walk(*near, *size, *mode as u32), "texel {texel} of {size}, mode {mode}");
    }
}

/// log₂ of the longer side, 0 below one texel, against f64 to 1e-5 (a GPU's log2 is good to some units in the last place).
#[test]
fn levels_are_those_of_the_longer_side() {
    let mut random = Random(31);
    let mut inputs: Vec<[f32; 4]> = (0..5000)
        .map(|_| {
            let scale = 10f32.powf(random.range(-3.0, 4.0));
            std::array::from_fn(|_| scale * random.range(-1.0, 1.0))
        })
        .collect();
    inputs.extend([[0.0; 4], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0], [3.0, 4.0, 0.0, 0.0]]);
    let found: Vec<[f32; 1]> = map(
        "#import lucerna::texture::footprint::texture_level
         alias Input = vec4<f32>;
         struct Output { level: f32 }
         fn map(x: Input) -> Output { return Output(texture_level(x.xy, x.zw)); }",
        &inputs,
    );
    for (input, [found]) in inputs.iter().zip(found) {
        let [a, b, c, d] = input.map(f64::from);
        let expected = DVec2::new(a, b).length().max(DVec2::new(c, d).length()).log2().max(0.0);
        assert!(
            (f64::from(found) - expected).abs() < 1e-5,
            "level of the footprint {input:?} is {found}, expected {expected} within 1e-5"
        );
    }
}

/// The weighted mips are the level of detail, and the finer one is at most one level finer.
#[test]
fn mips_around_a_level_sum_to_it() {
    let mut random = Random(33);
    let mut inputs: Vec<f32> = (0..2000).map(|_| random.range(0.0, 31.0)).collect();
    inputs.extend([0.0, 1.0, 5.0, 30.999_998, 31.0, 31.5, 32.0, 40.0, 1e9]);
    let found: Vec<[f32; 4]> = map(
        "#import lucerna::texture::footprint::mips_between
         alias Input = f32;
         alias Output = vec4<f32>;
         fn map(x: f32) -> Output {
             let mips = mips_between(x);
             return vec4<f32>(f32(mips.first), mips.weights, 0.0);
         }",
        &inputs,
    );
    for (&level, found) in inputs.iter().zip(found) {
        let [first, fine, coarse, _] = found.map(f64::from);
        let level = f64::from(level).min(32.0);
        assert!(
            fine >= 0.0 && coarse >= 0.0 && fine + coarse == 1.0,
            "weights of mips at level {level} are {fine} and {coarse}, expected at least 0 and a sum of 1"
        );
        assert_eq!(first, level.floor().min(31.0), "the finer mip at level {level}");
        // 1 − share rounds by 2⁻²⁵.
        assert!(
            (first + coarse - level).abs() <= 3e-8,
            "mean of mips at level {level} is {}, expected the level within 3e-8",
            first + coarse
        );
    }
}

/// The changes of weights give back two steps in the triangle's plane: one of the asked width along the first edge, and one of that width
/// across it. Tolerance: 60 roundings over the sine of the angle between the edges, twice (N enters squared).
#[test]
fn footprints_are_squares_on_the_triangle() {
    let mut random = Random(32);
    let mut inputs: Vec<[Vec4; 2]> = (0..5000)
        .map(|_| {
            let scale = 10f32.powf(random.range(-2.0, 2.0));
            let to_b = scale * random.direction();
            let to_c = scale * random.range(0.2, 3.0) * random.direction();
            [to_b.extend(10f32.powf(random.range(-2.0, 2.0))), to_c.extend(0.0)]
        })
        .collect();
    let no_area = [Vec4::new(1.0, 2.0, 3.0, 0.5), Vec4::new(2.0, 4.0, 6.0, 0.0)];
    inputs.extend([no_area, [Vec4::new(0.0, 0.0, 0.0, 1.0), Vec4::ONE]]);
    let found: Vec<Vec4> = map(
        "#import lucerna::texture::footprint::footprint_of_width
         struct Input { b: vec4<f32>, c: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return footprint_of_width(x.b.xyz, x.c.xyz, x.b.w); }",
        &inputs,
    );
    for ([b, c], found) in inputs.iter().zip(&found).take(5000) {
        let (to_b, to_c) = (b.truncate().as_dvec3(), c.truncate().as_dvec3());
        let (width, f) = (f64::from(b.w), found.as_dvec4());
        let sine = to_b.cross(to_c).length() / (to_b.length() * to_c.length());
        if sine < 0.01 {
            continue;
        }
        let along = to_b * f.x + to_c * f.y;
        let across = to_b * f.z + to_c * f.w;
        let bound = 60.0 * 6e-8 * width / (sine * sine);
        let expected = to_b.normalize() * width;
        let beside = to_b.cross(to_c).cross(to_b).normalize() * width;
        assert!(
            (along - expected).length() < bound,
            "edges {b}, {c}: the step along the first is {along}, expected {expected} within {bound:.1e}"
        );
        assert!(
            (across - beside).length() < bound,
            "edges {b}, {c}: the step across the first is {across}, expected {beside} within {bound:.1e}"
        );
    }
    assert_eq!(found[5000..], [Vec4::ZERO; 2], "footprints of triangles without area");
}

/// Against f64: the frame is made orthogonal, mirrored or not; without a usable tangent only z counts.
/// Tolerance: 40 roundings over the sine of the tangent to the normal, and over the length of the sum.
#[test]
fn normal_maps_follow_the_frame() {
    let mut random = Random(33);
    let mut inputs: Vec<[Vec4; 3]> = (0..5000)
        .map(|ix| {
            let texel = Vec3::from_array(std::array::from_fn(|_| random.unit()));
            let tangent = random.range(0.3, 2.0) * random.direction();
            [
                texel.extend(random.range(0.0, 2.0)),
                random.direction().extend((ix % 2) as f32),
                tangent.extend(0.0),
            ]
        })
        .collect();
    let flat = Vec4::new(0.5, 0.5, 1.0, 1.0);
    inputs.push([flat, Vec4::Y, Vec4::X]);
    inputs.push([Vec4::new(1.0, 0.5, 1.0, 1.0), Vec4::Y, Vec4::ZERO]);
    inputs.push([Vec4::new(1.0, 0.5, 0.5, 1.0), Vec4::Y, Vec4::X]);
    let found: Vec<Vec4> = map(
        "#import lucerna::texture::normal_map::normal_of_map
         struct Input { texel: vec4<f32>, normal: vec4<f32>, tangent: vec4<f32> }
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output {
             return vec4<f32>(normal_of_map(x.texel.xyz, x.texel.w, x.normal.xyz, x.tangent.xyz, x.normal.w == 1.0), 0.0);
         }",
        &inputs,
    );
    for ([texel, normal, tangent], found) in inputs.iter().zip(&found).take(5000) {
        let (n, t) = (normal.truncate().as_dvec3(), tangent.truncate().as_dvec3());
        let right = t - n * t.dot(n);
        let sine = right.length() / t.length();
        let right = right.normalize();
        let side = if normal.w == 1.0 { -1.0 } else { 1.0 };
        let local = texel.truncate().as_dvec3() * 2.0 - 1.0;
        let scale = f64::from(texel.w);
        let sum = right * local.x * scale + n.cross(right) * side * local.y * scale + n * local.z;
        if sine < 0.05 || sum.length() < 0.05 {
            continue;
        }
        let error = (found.truncate().as_dvec3() - sum.normalize()).length();
        assert!(
            error < 40.0 * 6e-8 * (1.0 / sine + 1.0 / sum.length()),
            "texel {texel}, normal {normal}, tangent {tangent}: the normal is {}, expected {} within {:.1e}",
            found.truncate(),
            sum.normalize(),
            40.0 * 6e-8 * (1.0 / sine + 1.0 / sum.length())
        );
    }
    let tail: Vec<_> = found[5000..].iter().map(|v| v.truncate()).collect();
    let cases = ["flat map", "no tangent", "45° along the tangent"];
    for ((found, expected), what) in tail.iter().zip([Vec3::Y, Vec3::Y, Vec3::X]).zip(cases) {
        assert!(
            (*found - expected).length() < 1e-6,
            "{what}: the normal is {found}, expected {expected} within 1e-6"
        );
    }
}

/// Bilinear between the texels' centres, against f64, with the horizon closed and the poles' rows held.
/// Tolerance: lavapipe's atan2 is good to 2e-5·π of a radian, so a coordinate to 5e-5 texels; two of them, over steps of at most 4.
#[test]
fn equirectangular_maps_are_read_bilinearly() {
    let [w, h] = [5u32, 4u32];
    let mut random = Random(34);
    let texels: Vec<[f32; 4]> =
        (0..w * h).map(|_| std::array::from_fn(|_| random.range(0.0, 4.0))).collect();
    let gpu = gpu();
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("map"),
            size: wgpu::Extent3d { width: w, height: h, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    );
    let view = texture.create_view(&Default::default());
    let mut inputs: Vec<Vec4> = (0..5000).map(|_| random.direction().extend(0.0)).collect();
    inputs.extend([Vec4::Y, -Vec4::Y, Vec4::X, -Vec4::X, Vec4::Z, -Vec4::Z]);
    inputs.extend([1e-6f32, -1e-6].map(|x| Vec4::new(x, 0.0, -1.0, 0.0)));
    let found: Vec<Vec4> = map_with(
        "#import lucerna::sky::equirectangular::equirectangular_color
         @group(0) @binding(2) var sky: texture_2d<f32>;
         alias Input = vec4<f32>;
         alias Output = vec4<f32>;
         fn map(x: Input) -> Output { return vec4<f32>(equirectangular_color(sky, vec2<u32>(5u, 4u), x.xyz), 0.0); }",
        &inputs,
        &[wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&view) }],
    );
    let texel = |x: i64, y: i64| {
        let (x, y) = (x.rem_euclid(w.into()), y.clamp(0, i64::from(h) - 1));
        let [r, g, b, _] = texels[(y * i64::from(w) + x) as usize].map(f64::from);
        DVec3::new(r, g, b)
    };
    for (input, found) in inputs.iter().zip(&found) {
        let d = input.truncate().as_dvec3();
        let u = (d.x.atan2(-d.z) / TAU).rem_euclid(1.0);
        let v = d.x.hypot(d.z).atan2(d.y) * 2.0 / TAU;
        let read = |u: f64| {
            let at = DVec2::new(u * f64::from(w), v * f64::from(h)) - 0.5;
            let (base, share) = (at.floor(), at - at.floor());
            let (x, y) = (base.x as i64, base.y as i64);
            let row = |y| texel(x, y).lerp(texel(x + 1, y), share.x);
            row(y).lerp(row(y + 1), share.y)
        };
        let error = |u: f64| (found.truncate().as_dvec3() - read(u)).largest();
        if d.x == 0.0 && d.z == 0.0 {
            // Of the poles' u the module states nothing: some u gives the colour, to the step between those tried.
            let least = (0..5000).map(|k| error(f64::from(k) / 5000.0)).fold(f64::MAX, f64::min);
            assert!(
                least < 5e-3,
                "colour at the pole {input} is {found}, off by {least} from that of the nearest u, expected below 5e-3"
            );
            continue;
        }
        assert!(
            error(u) < 4e-4,
            "colour towards {input} is {}, expected {} within 4e-4",
            found.truncate(),
            read(u)
        );
    }
}
