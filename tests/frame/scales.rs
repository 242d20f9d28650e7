// SPDX-License-Identifier: MIT OR Apache-2.0
//! What is smaller than a pixel, nearer than a centimetre, brighter or dimmer than 16-bit floats hold, or more than a driver
//! loops.

use crate::harness::{Largest, gpu, read};
use crate::support::{add_texture, diffuse, emitter, lambert, look_down, quad, scene};
use crate::whole::{Rendered, accumulated, render};
use glam::{UVec2, Vec3};
use lucerna::frame::ViewSettings;
use lucerna::scene::{AlphaMode, Camera, Material, Mesh, Projection, Sky};
use lucerna::techniques::NoIndirect;
use lucerna::techniques::reference::Channel;

/// A horizontal rectangle that faces up.
fn plate(x: [f32; 2], y: f32, z: [f32; 2], material: usize) -> Mesh {
    quad([[x[0], y, z[0]], [x[0], y, z[1]], [x[1], y, z[1]], [x[1], y, z[0]]], material)
}

/// The mean over frames of an emitter that covers a part of a pixel is that part of its radiance, wherever in the pixel it
/// lies: within 2 % (of 4096 frames, stratified in rows and columns, a strip has at most one more or less: 0.3 % of one
/// that covers 8 %). The parts keep off the pixel's border, for lavapipe shifts all edges by half of 1/256 of a pixel.
#[test]
fn an_emitter_smaller_than_a_pixel_counts_by_what_it_covers() {
    let parts = [
        ([0.01, 0.99], [0.91, 0.99]),
        ([0.01, 0.99], [0.01, 0.09]),
        ([0.91, 0.99], [0.01, 0.99]),
        ([0.01, 0.09], [0.01, 0.99]),
        ([0.4, 0.7], [0.1, 0.4]),
        ([0.03, 0.18], [0.45, 0.95]),
    ];
    let size = UVec2::splat(4);
    for (x, z) in parts {
        // Pixel (2, 2) spans 0 to 1 m.
        let world = diffuse(&scene(vec![plate(x, 0.0, z, 0)], vec![emitter([3.0, 2.0, 1.0])]));
        let found = render(&world, &look_down(1.0, 2.0), size, accumulated(4096, 0), 1);
        let emitted = found.channel(Channel::Emitted);
        let coverage = (x[1] - x[0]) * (z[1] - z[0]);
        let error = emitted[2 * 4 + 2] / (Vec3::new(3.0, 2.0, 1.0) * coverage) - 1.0;
        println!("{x:?} {z:?}: off by {:.2} %", 100.0 * error.x);
        assert!(
            error.largest() <= 0.02,
            "emitter at x {x:?}, z {z:?}: emitted light is {}, expected {coverage} of its radiance: off by {error}, expected at most 0.02",
            emitted[2 * 4 + 2]
        );
        let others = emitted.iter().enumerate().filter(|(ix, _)| *ix != 2 * 4 + 2);
        for (ix, rgb) in others {
            assert_eq!(
                *rgb,
                Vec3::ZERO,
                "emitter at x {x:?}, z {z:?}: emitted light of pixel {ix}, which it does not cover"
            );
        }
    }
}

/// Already of 32 frames a strip along any side of the pixel has its part of the samples, to one: frames are stratified in rows and
/// columns. (Of the R2 sequence's first 32 points none lies in the lowest 8 % of the pixel.)
#[test]
fn few_frames_see_a_strip_along_any_side() {
    let parts = [
        ([0.01, 0.99], [0.91, 0.99]),
        ([0.01, 0.99], [0.01, 0.09]),
        ([0.91, 0.99], [0.01, 0.99]),
        ([0.01, 0.09], [0.01, 0.99]),
    ];
    for (x, z) in parts {
        let world = diffuse(&scene(vec![plate(x, 0.0, z, 0)], vec![emitter([1.0; 3])]));
        let found = render(&world, &look_down(1.0, 2.0), UVec2::splat(4), accumulated(32, 0), 1);
        let seen = 32.0 * found.channel(Channel::Emitted)[2 * 4 + 2].x;
        let expected = 32.0 * (x[1] - x[0]) * (z[1] - z[0]);
        assert!(
            (seen - expected).abs() <= 1.1,
            "emitter at x {x:?}, z {z:?}: {seen} of 32 frames see it, expected {expected} within 1.1"
        );
    }
}

/// Scenes of all sizes are seen whole, from as near as their size: depths and direct light go with the scale.
#[test]
fn a_scene_of_any_size_is_seen() {
    for scale in [1e-5f32, 1e-3, 1.0, 1e4] {
        let floor = plate([-scale, scale], 0.0, [-scale, scale], 0);
        let mut world = scene(vec![floor], vec![lambert([0.5; 3])]);
        world.sky = Sky::Constant(Vec3::ONE);
        let world = diffuse(&world);
        let camera = Camera {
            position: Vec3::new(0.0, 0.1 * scale, 0.0),
            projection: Projection::Perspective { vertical_fov: 1.0 },
            ..look_down(1.0, 1.0)
        };
        let found = render(&world, &camera, UVec2::splat(4), accumulated(16, 0), 4);
        for depth in found.channel(Channel::Depth) {
            let error = (depth.x / (0.1 * scale) - 1.0).abs();
            assert!(
                error <= 1e-5,
                "floor of {scale} m: depth is {}, expected {} within 1e-5 of it",
                depth.x,
                0.1 * scale
            );
        }
        // An open floor under a white sky: ρ.
        let direct = found.channel(Channel::Direct);
        let mean = direct.iter().sum::<Vec3>().x / direct.len() as f32;
        assert!(
            (mean - 0.5).abs() <= 0.01,
            "floor of {scale} m: mean direct light is {mean}, expected 0.5 within 0.01"
        );
    }
}

/// A plate of 1 mm, 3 mm before the camera, over a ground of 1 km: both are seen, at their depths.
#[test]
fn what_is_close_is_seen_in_a_large_scene() {
    let meshes = vec![
        plate([-1000.0, 1000.0], 0.0, [-1000.0, 1000.0], 0),
        plate([-5e-4, 5e-4], 0.497, [-5e-4, 5e-4], 1),
    ];
    let world = diffuse(&scene(meshes, vec![lambert([0.25; 3]), lambert([0.75; 3])]));
    let camera = Camera {
        position: Vec3::new(0.0, 0.5, 0.0),
        projection: Projection::Perspective { vertical_fov: 1.0 },
        ..look_down(1.0, 1.0)
    };
    let found = render(&world, &camera, UVec2::splat(8), accumulated(1, 0), 1);
    let (depth, albedo) = (found.channel(Channel::Depth), found.channel(Channel::Albedo));
    // The plate covers the inner third of the picture: tan(½) · 3 mm is 1.64 mm.
    let (inner, corner) = (3 * 8 + 3, 0);
    // 0.5 − 0.497 has 17 bits in f32.
    assert!(
        (depth[inner].x / 0.003 - 1.0).abs() < 2e-5,
        "depth of the plate is {}, expected 0.003 within 2e-5 of it",
        depth[inner].x
    );
    assert!(
        (depth[corner].x / 0.5 - 1.0).abs() < 1e-6,
        "depth of the ground is {}, expected 0.5 within 1e-6 of it",
        depth[corner].x
    );
    assert!(
        (albedo[inner].x - 0.75).abs() < 0.005 && (albedo[corner].x - 0.25).abs() < 0.005,
        "albedo of the plate is {} and of the ground {}, expected 0.75 and 0.25 within 0.005",
        albedo[inner].x,
        albedo[corner].x
    );
}

/// k times the light is k times the picture: emitted and direct, within a part in a thousand.
#[test]
fn pictures_scale_with_the_lights() {
    let light = |k: f32| {
        let meshes = vec![
            plate([-2.0, 2.0], 0.0, [-2.0, 2.0], 0),
            // Seen from above, and lit through a gap by the other one, which faces down.
            plate([-0.5, 0.5], 0.6, [-0.5, 0.5], 1),
            quad([[-0.5, 0.5, 0.5], [-0.5, 0.5, -0.5], [0.5, 0.5, -0.5], [0.5, 0.5, 0.5]], 1),
        ];
        let emission = Vec3::new(17.0, 12.0, 4.0) * k;
        let world = diffuse(&scene(meshes, vec![lambert([0.5; 3]), emitter(emission.into())]));
        let size = UVec2::splat(8);
        let found = render(&world, &look_down(3.0, 2.0), size, accumulated(8, 0), 4);
        assert_eq!(
            found.n_rejected, 0,
            "{k:e} times the light: pixels are rejected, expected none"
        );
        [Channel::Emitted, Channel::Direct].map(|channel| found.channel(channel))
    };
    let one = light(1.0);
    for k in [1e-6f32, 1e-3, 1e3, 1e6] {
        for (scaled, plain) in light(k).iter().flatten().zip(one.iter().flatten()) {
            let error = (*scaled / k - *plain).largest();
            assert!(
                error <= 1e-3 * plain.max_element(),
                "{k:e} times the light: a pixel is {} per unit, expected {plain} within 1e-3 of its largest",
                *scaled / k
            );
        }
    }
}

/// Where a driver ends loops early, pixels whose direct light is wrong are counted; where not, the light is right.
#[test]
fn direct_light_is_right_or_counted() {
    let mut meshes = vec![plate([-1.0, 1.0], 0.0, [-1.0, 1.0], 0)];
    meshes.extend((1..=300).map(|ix| plate([-1.0, 1.0], ix as f32 * 1e-3, [-1.0, 1.0], 1)));
    let layer = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..lambert([0.1; 3]) };
    let mut world = scene(meshes, vec![lambert([0.8; 3]), layer]);
    let clear = add_texture(&mut world, 1, vec![[255, 255, 255, 0]]);
    world.materials[1].base_color_texture = Some(clear);
    world.sky = Sky::Constant(Vec3::ONE);
    let world = diffuse(&world);
    let mut found = Rendered::new(&world, UVec2::splat(2), 1024);
    found.run(&world, &look_down(2.0, 0.2), ViewSettings::default(), &mut NoIndirect);
    let [n_rejected, n_cut]: [u32; 2] =
        bytemuck::pod_read_unaligned(&read(found.passes.direct.faults())[..8]);
    assert_eq!(n_rejected, 0, "pixels are rejected, expected none");
    let direct = found.channel(Channel::Direct);
    let n_wrong = direct.iter().filter(|rgb| (**rgb - 0.8).largest() > 0.08).count();
    println!("{}: {n_wrong} wrong, {n_cut} counted", gpu().device.adapter_info().name);
    assert!(
        n_wrong as u32 <= n_cut,
        "{n_wrong} pixels of direct light are beside 0.8 by more than 0.08, expected at most the {n_cut} that are counted as cut: {direct:?}"
    );
}
