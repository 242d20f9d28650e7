// SPDX-License-Identifier: MIT OR Apache-2.0
//! Surfaces that shine, and masks that cast shadows.

use crate::harness::{Largest, assert_each, ray_query_gpu};
use crate::support::{
    add_texture, batches, ceiling, diffuse, emitter, floor, lambert, look_down, on_gpu,
    over_pixels, quad, render, scene, settings,
};
use glam::{DVec3, UVec2, Vec3};
use lucerna::gpu_scene::RaySource;
use lucerna::scene::{AlphaMode, Light, Material, Scene};
use lucerna::techniques::reference::{Channel, resolve};
use std::f64::consts::PI;

const RADIANCE: [f32; 3] = [10.0, 5.0, 1.0];
const ALBEDO: [f32; 3] = [0.8, 0.5, 0.2];
/// Height of the emitter over the floor, and half the side of what the camera sees [m].
const HEIGHT: f32 = 1.0;
const HALF: f32 = 1.5;

/// The rectangle x0..x1 × z0..z1 at `y`, facing down.
fn lamp(x: [f32; 2], z: [f32; 2], y: f32, material: usize) -> lucerna::scene::Mesh {
    let corners = [[x[0], y, z[1]], [x[0], y, z[0]], [x[1], y, z[0]], [x[1], y, z[1]]];
    quad(corners, material)
}

/// Irradiance on the plane y = 0 from a polygon of radiance 1 above it: Lambert's formula
/// ½ Σ Γᵢ (γᵢ·n), Γᵢ the angle of an edge and γᵢ the normal of its plane through the point.
fn polygon_irradiance(at: DVec3, corners: &[DVec3]) -> f64 {
    let sum: f64 = (0..corners.len())
        .map(|ix| {
            let (a, b) = (corners[ix] - at, corners[(ix + 1) % corners.len()] - at);
            a.angle_between(b) * a.cross(b).normalize().y
        })
        .sum();
    0.5 * sum.abs()
}

fn rectangle_irradiance(x: [f32; 2], z: [f32; 2], size: UVec2) -> Vec<DVec3> {
    let corner = |x: f32, z: f32| Vec3::new(x, HEIGHT, z).as_dvec3();
    let corners = [corner(x[0], z[0]), corner(x[0], z[1]), corner(x[1], z[1]), corner(x[1], z[0])];
    over_pixels(size, |p| {
        let at = DVec3::new(p.x, 0.0, p.y) * f64::from(HALF);
        Vec3::from(RADIANCE).as_dvec3() * polygon_irradiance(at, &corners)
    })
}

/// The camera hangs below the lamp. `n_bounces` may be any: the lamp is black.
fn check_floor(what: &str, world: &Scene, irradiance: &[DVec3], rays: RaySource) {
    let world = on_gpu(world, true, rays);
    let found = batches(&world, &look_down(0.5, HALF), &settings(16, 16, 3), 4096);
    let reflected: Vec<_> =
        irradiance.iter().map(|&e| e * Vec3::from(ALBEDO).as_dvec3() / PI).collect();
    found.estimate(Channel::Beauty).check(what, &reflected, 0.008);
    found.estimate(Channel::Direct).check(what, &reflected, 0.008);
    for dark in [Channel::Emitted, Channel::Indirect] {
        assert_each(
            &format!("{what}, pixels of {dark:?}"),
            &found.estimate(dark).pixels(),
            "black",
            |&pixel| pixel == DVec3::ZERO,
        );
    }
}

const X: [f32; 2] = [-0.5, 0.75];
const Z: [f32; 2] = [-0.25, 0.5];

fn under_lamp(material: Material) -> Scene {
    let meshes = vec![floor(10.0, 0.0, 0), lamp(X, Z, HEIGHT, 1)];
    scene(meshes, vec![lambert(ALBEDO), material])
}

fn size() -> UVec2 {
    UVec2::splat(16)
}

#[test]
fn emissive_quad_over_a_plane() {
    let truth = rectangle_irradiance(X, Z, size());
    check_floor("lamp", &under_lamp(emitter(RADIANCE)), &truth, RaySource::Software);
}

#[test]
fn ray_query_emissive_quad_over_a_plane() {
    if ray_query_gpu().is_some() {
        let truth = rectangle_irradiance(X, Z, size());
        check_floor("lamp", &under_lamp(emitter(RADIANCE)), &truth, RaySource::RayQuery);
    }
}

/// A lamp of the largest and of the least extent that MIS must balance.
#[test]
fn near_and_small_emissive_quads() {
    for (what, half) in [("huge lamp", 50.0), ("small lamp", 0.02)] {
        let (x, z) = ([-half, half], [-half, half]);
        let mut world = under_lamp(emitter(RADIANCE));
        world.meshes[1] = lamp(x, z, HEIGHT, 1);
        check_floor(what, &world, &rectangle_irradiance(x, z, size()), RaySource::Software);
    }
}

/// Emission leaves the front; both sides of a double-sided material. A mirroring transform keeps
/// the front.
#[test]
fn emission_leaves_the_front_unless_double_sided() {
    let truth = rectangle_irradiance(X, Z, size());
    let mut turned = under_lamp(emitter(RADIANCE));
    for triangle in &mut turned.meshes[1].triangles {
        triangle.swap(1, 2);
    }
    let world = diffuse(&turned);
    let found = render(&world, &look_down(0.5, HALF), &settings(16, 16, 3), 256);
    let lit = resolve(&found, size(), Channel::Beauty);
    assert_each("beauty of pixels under a lamp's back", &lit.rgb, "black", |&pixel| {
        pixel == Vec3::ZERO
    });
    // From above the front is seen.
    let from_above = render(&world, &look_down(2.0, 0.2), &settings(8, 8, 0), 1);
    let seen = resolve(&from_above, UVec2::splat(8), Channel::Emitted);
    assert_each(
        "emitted light of pixels that see a lamp's front",
        &seen.rgb,
        &format!("{RADIANCE:?}"),
        |&pixel| pixel == Vec3::from(RADIANCE),
    );

    let mut mirrored = turned.clone();
    mirrored.instances[1].world_from_object = glam::Affine3A::from_scale(Vec3::new(-1.0, 1.0, 1.0));
    let x = [-X[1], -X[0]];
    // The object's winding is still the wrong one.
    let world = diffuse(&mirrored);
    let found = render(&world, &look_down(0.5, HALF), &settings(16, 16, 3), 64);
    let lit = resolve(&found, size(), Channel::Beauty);
    assert_each("beauty of pixels under a mirrored lamp's back", &lit.rgb, "black", |&pixel| {
        pixel == Vec3::ZERO
    });
    let mut front = under_lamp(emitter(RADIANCE));
    front.instances[1].world_from_object = mirrored.instances[1].world_from_object;
    check_floor("mirrored", &front, &rectangle_irradiance(x, Z, size()), RaySource::Software);

    turned.materials[1].double_sided = true;
    check_floor("double-sided", &turned, &truth, RaySource::Software);
    let world = diffuse(&under_lamp(emitter(RADIANCE)));
    let from_above = render(&world, &look_down(2.0, 0.2), &settings(8, 8, 0), 1);
    let seen = resolve(&from_above, UVec2::splat(8), Channel::Emitted);
    assert_each("emitted light of pixels that see a lamp's back", &seen.rgb, "black", |&pixel| {
        pixel == Vec3::ZERO
    });
}

/// The texture leaves the half u < 0.5 lit, at sRGB 188 of 255: 0.50289 of the light. (lavapipe decodes
/// it 0.1 % off, which the tolerance holds as well.)
#[test]
fn emission_texture_shapes_the_light() {
    let mut world = under_lamp(emitter(RADIANCE));
    let texture = add_texture(&mut world, 2, vec![[188, 188, 188, 255], [0, 0, 0, 255]]);
    world.materials[1].emission_texture = Some(texture);
    let share = lucerna::picture::srgb::linear_from_encoded(188.0 / 255.0);
    let truth: Vec<_> = rectangle_irradiance([X[0], 0.5 * (X[0] + X[1])], Z, size())
        .into_iter()
        .map(|e| e * share)
        .collect();
    check_floor("textured lamp", &world, &truth, RaySource::Software);
}

/// What a mask has cut away of a lamp does not shine.
#[test]
fn masked_emitter_shines_only_where_it_is() {
    let mut world = under_lamp(emitter(RADIANCE));
    let texture = add_texture(&mut world, 2, vec![[255; 4], [255, 255, 255, 0]]);
    world.materials[1].base_color_texture = Some(texture);
    world.materials[1].alpha = AlphaMode::Mask { cutoff: 0.5 };
    let truth = rectangle_irradiance([X[0], 0.5 * (X[0] + X[1])], Z, size());
    check_floor("masked lamp", &world, &truth, RaySource::Software);
}

/// One reflection from the lamp's own side is direct, two are indirect: a closed pair of planes,
/// the lower one black, has no indirect light; with a grey one the ceiling's light comes back.
#[test]
fn indirect_light_needs_two_reflections() {
    let lit = |floor_albedo: f32, n_bounces| {
        let materials =
            vec![lambert([floor_albedo; 3]), Material { emission: Vec3::ONE, ..lambert([0.5; 3]) }];
        // Parallel planes without end: every reflection sees the other plane only.
        let meshes = vec![floor(3000.0, 0.0, 0), ceiling(3000.0, 1.0, 1)];
        let world = diffuse(&scene(meshes, materials));
        batches(&world, &look_down(0.5, 0.5), &settings(8, 8, n_bounces), 8192)
    };
    // L_floor = ρ(1 + ½ L_floor'), so beauty = ρ Σ (ρ/2)ᵏ: direct ρ, then ρ·ρ/2, … Of the planes'
    // finite size less than 1e-6 is missing.
    let found = lit(0.8, 0);
    found.estimate(Channel::Direct).check_all("pair, direct", DVec3::splat(0.8), 0.008);
    assert_eq!(found.estimate(Channel::Indirect).mean(), DVec3::ZERO, "mean of indirect light");
    // The ceiling's second reflection arrives after floor and ceiling and floor: two bounces more.
    let found = lit(0.8, 1);
    assert_eq!(found.estimate(Channel::Indirect).mean(), DVec3::ZERO, "mean of indirect light");
    let found = lit(0.8, 2);
    let expected = DVec3::splat(0.8 * 0.4);
    found.estimate(Channel::Indirect).check_all("pair, indirect", expected, 0.008);
}

/// 8 × 8 texels, every other one cut away, between light and floor. Light comes straight down and
/// then aslant, shifting the shadow by one texel: every pixel is wholly lit or wholly dark. Seen
/// from above, holes show the floor.
fn masked_shadow(rays: RaySource) {
    let n = 8u32;
    let is_solid = |x: u32, z: u32| (x + z + x / 4).is_multiple_of(2);
    let texels: Vec<[u8; 4]> = (0..n * n)
        .map(|ix| [255, 255, 255, if is_solid(ix % n, ix / n) { 255 } else { 0 }])
        .collect();
    let mut world = scene(
        vec![floor(10.0, 0.0, 0), floor(1.0, 1.0, 1)],
        vec![lambert(ALBEDO), lambert([1.0; 3])],
    );
    let texture = add_texture(&mut world, n, texels);
    world.materials[1].base_color_texture = Some(texture);
    world.materials[1].alpha = AlphaMode::Mask { cutoff: 0.5 };
    for shift in [0, 1] {
        let direction = Vec3::new(0.25 * shift as f32, -1.0, 0.0).normalize();
        world.lights = vec![Light::Directional { direction, irradiance: Vec3::ONE }];
        let on_gpu = on_gpu(&world, true, rays);
        let found = render(&on_gpu, &look_down(0.5, 1.0), &settings(16, 16, 0), 16);
        let lit = resolve(&found, size(), Channel::Beauty);
        // E = cosθ, L = ρE/π; relative 1e-5 for a few roundings.
        let bright = Vec3::from(ALBEDO) * -direction.y / PI as f32;
        for (ix, &pixel) in lit.rgb.iter().enumerate() {
            let (x, z) = ((ix % 16 / 2) as u32, (ix / 32) as u32);
            // Left of the mask's shadow nothing stands in the way.
            let shaded = x >= shift && is_solid(x - shift, z);
            let expected = if shaded { Vec3::ZERO } else { bright };
            // An offset of 1e-6 m and a slanted ray may cross a texel's edge in a 1e-5 of a pixel.
            let off = (pixel - expected).largest();
            assert!(
                off <= 1e-5,
                "shift {shift}: beauty of pixel {ix} is {pixel}, expected {expected} within 1e-5"
            );
        }
        let seen = render(&on_gpu, &look_down(2.0, 1.0), &settings(16, 16, 0), 16);
        let seen = resolve(&seen, size(), Channel::Depth);
        for (ix, &depth) in seen.rgb.iter().enumerate() {
            let is_solid = is_solid((ix % 16 / 2) as u32, (ix / 32) as u32);
            let expected = if is_solid { 1.0 } else { 2.0 };
            assert!(
                (depth.x - expected).abs() < 1e-5,
                "shift {shift}: depth of pixel {ix} is {}, expected {expected} within 1e-5",
                depth.x
            );
        }
    }
}

#[test]
fn masks_cast_shadows_with_holes() {
    masked_shadow(RaySource::Software);
}

#[test]
fn ray_query_masks_cast_shadows_with_holes() {
    if ray_query_gpu().is_some() {
        masked_shadow(RaySource::RayQuery);
    }
}
