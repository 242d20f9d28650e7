// SPDX-License-Identifier: MIT OR Apache-2.0
//! Material textures through the albedo channel, one sample a pixel, against bilinear filtering in f64.

use crate::harness::{KeepNan, Largest, Random};
use crate::support::{add_texture, diffuse, floor, look_down, render, scene, settings};
use crate::texture_oracle::sample;
use glam::{Affine2, DVec2, DVec3, UVec2, Vec2, Vec4};
use lucerna::scene::{Filter, Scene, Texture, Wrap};
use lucerna::techniques::reference::{Channel, resolve};

const SIZE: u32 = 24;

/// Where sample 0 of a pixel falls within it: pcg4d (Jarzynski, Olano 2020) of (pixel, seed 0,
/// sample 0, dimension 0), 24 bits a coordinate.
fn jitter(pixel_ix: u32) -> DVec2 {
    let mut v = [pixel_ix, 0, 0, 0].map(|x: u32| x.wrapping_mul(1664525).wrapping_add(1013904223));
    let mix = |v: &mut [u32; 4]| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    DVec2::new(f64::from(v[0] >> 8), f64::from(v[1] >> 8)) / f64::from(1 << 24)
}

/// A floor from −1 to 1 whose mesh coordinates run over −2.2 … 3.1: wrapped several times.
fn textured(width: u32, height: u32, edit: impl FnOnce(&mut Scene)) -> Scene {
    let mut random = Random(u64::from(width * 100 + height));
    let mut world = scene(vec![floor(1.0, 0.0, 0)], vec![crate::support::lambert([1.0; 3])]);
    let mesh = &mut world.meshes[0];
    let stretch = |uv: Vec2| Vec2::new(-2.2, -1.7) + uv * Vec2::new(5.3, 4.1);
    mesh.uv1 = mesh.uv0.iter().map(|&uv| stretch(Vec2::new(uv.y, 1.0 - uv.x))).collect();
    mesh.uv0 = mesh.uv0.iter().map(|&uv| stretch(uv)).collect();
    let texels = (0..width * height)
        .map(|_| (random.bits() as u32).to_le_bytes().map(|byte| 255 * (byte >> 7)))
        .collect();
    let texture = add_texture(&mut world, width, texels);
    world.materials[0].base_color_texture = Some(texture);
    edit(&mut world);
    world
}

/// Texels of 0 and 255 are decoded exactly. uv is good to a few roundings of a range of 5 (1e-6), times
/// 8 texels a unit, times a step of 1 from texel to texel: 1e-5. With room for the hit's own rounding:
const TOLERANCE: f64 = 5e-5;
/// Drivers approximate sRGB's power (lavapipe: to 1.3e-3); a code of 8 bits is 4e-3 on average.
const GREY_TOLERANCE: f64 = 2.5e-3;

/// Compares every pixel; returns the largest error. Nearest filters jump: points within 1e-3 texels
/// of an edge are left out.
fn check(what: &str, world: &Scene, tolerance: f64) -> f64 {
    let sums = render(&diffuse(world), &look_down(1.0, 1.0), &settings(SIZE, SIZE, 0), 1);
    let found = resolve(&sums, UVec2::splat(SIZE), Channel::Albedo);
    let mesh = &world.meshes[0];
    let material = &world.materials[0];
    let texture = material.base_color_texture.as_ref().unwrap();
    let uv = if texture.uv_set == 1 { &mesh.uv1 } else { &mesh.uv0 };
    let (mut worst, mut left_out) = (0.0, 0);
    for ix in 0..SIZE * SIZE {
        let pixel = DVec2::new(f64::from(ix % SIZE), f64::from(ix / SIZE)) + jitter(ix);
        let [s, t] = (pixel / f64::from(SIZE)).to_array();
        // Corners of the floor: (0,0) (0,1) (1,1) (1,0); the map is affine.
        let at = |values: [Vec4; 4]| {
            let [a, b, c, d] = values.map(|v| v.as_dvec4());
            // Two triangles: a b c where t ≥ s, a c d where s ≥ t.
            if t >= s {
                a + (b - a) * (t - s) + (c - a) * s
            } else {
                a + (d - a) * (s - t) + (c - a) * t
            }
        };
        let here = at([0, 1, 2, 3].map(|k| uv[k].extend(0.0).extend(0.0)));
        let texel = sample(world, texture, Vec2::new(here.x as f32, here.y as f32), true);
        let is_nearest = world.textures[texture.texture].filter == Filter::Nearest;
        if is_nearest && texel.to_edge < 1e-3 {
            left_out += 1;
            continue;
        }
        let mut expected: DVec3 =
            texel.value.truncate() * material.base_color.truncate().as_dvec3();
        if !mesh.colors.is_empty() {
            expected *= at([0, 1, 2, 3].map(|k| mesh.colors[k])).truncate();
        }
        let off = (found.rgb[ix as usize].as_dvec3() - expected).largest();
        assert!(
            off <= tolerance,
            "{what}: albedo of pixel {ix} is {}, expected {expected} within {tolerance}",
            found.rgb[ix as usize]
        );
        worst = f64::max_nan(worst, off);
    }
    assert!(
        left_out < 20,
        "{what}: {left_out} pixels at the edge of texels are left out, expected below 20"
    );
    worst
}

#[test]
fn textures_wrap_and_filter() {
    let modes = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];
    let mut worst = 0.0;
    for (ix, wrap_u) in modes.into_iter().enumerate() {
        for (jx, wrap_v) in modes.into_iter().enumerate() {
            for filter in [Filter::Nearest, Filter::Linear] {
                let (width, height) = [(8, 4), (5, 3), (1, 7)][(ix + jx) % 3];
                let world = textured(width, height, |world| {
                    world.textures[0] = Texture { image: 0, wrap_u, wrap_v, filter };
                });
                let what = format!("{width}×{height}, {wrap_u:?} {wrap_v:?} {filter:?}");
                worst = f64::max_nan(worst, check(&what, &world, TOLERANCE));
            }
        }
    }
    println!("largest error {worst:.2e}");
}

#[test]
fn textures_with_transforms_sets_and_factors() {
    let linear = |world: &mut Scene| world.textures[0].filter = Filter::Linear;
    let transformed = textured(8, 4, |world| {
        linear(world);
        // KHR_texture_transform: translation · rotation · scale.
        let texture = world.materials[0].base_color_texture.as_mut().unwrap();
        texture.uv_from_mesh =
            Affine2::from_scale_angle_translation(Vec2::new(0.5, -1.5), 0.7, Vec2::new(0.3, -0.2));
    });
    let second_set = textured(8, 4, |world| {
        linear(world);
        world.materials[0].base_color_texture.as_mut().unwrap().uv_set = 1;
    });
    let with_factors = textured(8, 4, |world| {
        linear(world);
        world.materials[0].base_color = Vec4::new(0.9, 0.5, 0.25, 0.1);
        world.meshes[0].colors = vec![
            Vec4::new(1.0, 0.5, 0.25, 0.0),
            Vec4::new(0.0, 1.0, 0.5, 0.5),
            Vec4::ONE,
            Vec4::new(0.3, 0.2, 0.1, 1.0),
        ];
    });
    let whites = textured(2, 2, |world| world.images[0].rgba = vec![[255; 4]; 4]);
    for (what, world) in [
        ("transform", transformed),
        ("second set", second_set),
        ("vertex colours and factor", with_factors),
        ("white", whites),
    ] {
        println!("{what}: largest error {:.2e}", check(what, &world, TOLERANCE));
    }
}

/// Images share the atlas and do not leak into each other, whatever their sizes.
#[test]
fn textures_beside_each_other() {
    for (width, height) in [(16, 16), (3, 40), (33, 2)] {
        let world = textured(width, height, |world| {
            world.textures[0].filter = Filter::Linear;
            for (width, n) in [(7, 49), (64, 64), (1, 1), (300, 3000)] {
                let texture = add_texture(world, width, vec![[255, 0, 255, 255]; n]);
                world.materials.push(lucerna::scene::Material {
                    base_color_texture: Some(texture),
                    ..Default::default()
                });
            }
        });
        println!("{width}×{height}: largest error {:.2e}", check("atlas", &world, TOLERANCE));
    }
}

/// All 256 codes, decoded before they are filtered: between 0 and 255 stands 0.5, not 0.21.
#[test]
fn textures_are_decoded_from_srgb_before_filtering() {
    for filter in [Filter::Nearest, Filter::Linear] {
        let world = textured(16, 16, |world| {
            world.textures[0].filter = filter;
            let codes = (0..=255u8).map(|code| [code, 255 - code, code.reverse_bits(), 255]);
            world.images[0].rgba = codes.collect();
        });
        println!("{filter:?}: largest error {:.2e}", check("codes", &world, GREY_TOLERANCE));
    }
}
