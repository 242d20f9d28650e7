// SPDX-License-Identifier: MIT OR Apache-2.0
//! What the technique meets at the ends of its range.

use crate::harness::{KeepNan, Largest, assert_each, differing_bytes, gpu, read};
use crate::leaks::{Between, dark_over_lit, divided_room};
use crate::session::{SIDE, camera, lit_room, upload};
use crate::support::{floor, lambert, room, scene};
use crate::{cells, prefiltered, session};
use glam::{UVec2, UVec3, Vec3};
use lucerna::components::voxel_light::{Bounces, Levels};
use lucerna::components::voxel_pyramid::{ConeStepping, FaceWeights, PyramidStorage};
use lucerna::components::voxels::Resolution;
use lucerna::scene::{Camera, Light, Material, Scene, Sky};
use lucerna::settings;
use lucerna::techniques::TechniqueError;
use lucerna::techniques::reference::{Channel, ReferenceSettings, resolve};
use lucerna::techniques::voxel_cone::{Specular, VoxelCone, VoxelConeSettings};

fn eye() -> Camera {
    camera([0.7, 0.6, 0.4], [1.0, 0.4, 1.4])
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let world = upload(&lit_room());
    for base in [cells(20), prefiltered(20)] {
        let settings = settings!(VoxelConeSettings {
            levels: Levels::Nested(2),
            occludes_diffuse: true,
            ..base
        });
        let run = || session(&world, &eye(), settings).run(&world, 10);
        let (first, second) = (run(), run());
        let [a, b] = [&first, &second].map(|sums| bytemuck::cast_slice::<_, u8>(sums));
        assert!(a == b, "{settings:?}: sums of two runs: {}", differing_bytes(b, a));
        let lit = first.iter().filter(|pixel| pixel.indirect != Vec3::ZERO).count();
        assert!(
            lit > first.len() / 2,
            "{settings:?}: {lit} of {} pixels have indirect light, expected above half",
            first.len()
        );
    }
}

/// A grid of one cell, of sizes that are no powers of two, flat ones.
#[test]
fn any_grid_gives_finite_light() {
    let world = upload(&lit_room());
    let sizes = [UVec3::ONE, UVec3::new(2, 1, 3), UVec3::new(13, 7, 29), UVec3::new(64, 1, 1)];
    for (size, base) in
        sizes.into_iter().flat_map(|size| [(size, cells(1)), (size, prefiltered(1))])
    {
        let resolution = Resolution::Size(size);
        let mut session =
            session(&world, &eye(), settings!(VoxelConeSettings { resolution, ..base }));
        let pixels = session.run(&world, 8);
        assert_each(
            &format!("sums of pixels with a grid of {size}"),
            &pixels,
            "of finite indirect light without rejected samples",
            |pixel| pixel.indirect.is_finite() && pixel.n_rejected == 0,
        );
        assert_eq!(
            session.technique.grid(0).size,
            size,
            "size of the grid, expected the one that is set"
        );
        let counts: Vec<u32> =
            bytemuck::pod_collect_to_vec(&read(&session.technique.buffers().counts[0]));
        assert!(
            counts[0] > 0 && counts[1] == 0,
            "grid of {size}: {} voxels are made and {} left out, expected some and none",
            counts[0],
            counts[1]
        );
    }
}

/// Every setting does something, and none makes light that is no number.
#[test]
fn every_setting_changes_the_picture() {
    let world = upload(&lit_room());
    let base = prefiltered(20);
    let picture = |settings| {
        let mut session = session(&world, &eye(), settings);
        session.run(&world, 8);
        session.picture(&world, 4, Channel::Indirect)
    };
    let plain = picture(base);
    let stepping = base.stepping;
    for settings in [
        cells(20),
        settings!(VoxelConeSettings { anisotropic: false, ..base }),
        settings!(VoxelConeSettings { n_cones: 5, ..base }),
        settings!(VoxelConeSettings { n_cones: 6, ..base }),
        settings!(VoxelConeSettings { n_cones: 16, ..base }),
        settings!(VoxelConeSettings { n_bounce_cones: 5, ..base }),
        settings!(VoxelConeSettings { bounce_period: 2, ..base }),
        settings!(VoxelConeSettings { face_weights: FaceWeights::Squared, ..base }),
        settings!(VoxelConeSettings { opaque_backs: true, ..base }),
        settings!(VoxelConeSettings { occludes_diffuse: true, ..base }),
        settings!(VoxelConeSettings { seed: 1, ..base }),
        settings!(VoxelConeSettings {
            stepping: ConeStepping { step_scale: 1.0, ..stepping },
            ..base
        }),
        settings!(VoxelConeSettings {
            stepping: ConeStepping { mip_bias: 1.0, ..stepping },
            ..base
        }),
        settings!(VoxelConeSettings {
            stepping: ConeStepping { opacity_threshold: 0.5, ..stepping },
            ..base
        }),
        settings!(VoxelConeSettings {
            stepping: ConeStepping { start_cells: 3.0, ..stepping },
            ..base
        }),
    ] {
        let found = picture(settings);
        assert_each(
            &format!("{settings:?}: indirect light of pixels"),
            &found,
            "finite and at least 0",
            |pixel| pixel.is_finite() && pixel.min_element() >= 0.0,
        );
        assert!(
            found != plain,
            "{settings:?}: indirect light is that of the default settings, expected another"
        );
    }
    let buffers =
        picture(settings!(VoxelConeSettings { storage: PyramidStorage::Buffers, ..base }));
    for (ix, (one, other)) in plain.iter().zip(&buffers).enumerate() {
        assert!(
            (*one - *other).largest() < 0.01 * one.max_element() + 1e-4,
            "pixel {ix}: indirect light from buffers is {other}, from textures {one}; expected within 1 % and 1e-4"
        );
    }
}

#[test]
fn without_lights_it_stays_dark() {
    let world = upload(&Scene { lights: Vec::new(), ..lit_room() });
    let pixels = session(&world, &eye(), cells(16)).run(&world, 6);
    assert_each(
        "sums of pixels without lights",
        &pixels,
        "without indirect light and rejected samples",
        |pixel| pixel.indirect == Vec3::ZERO && pixel.n_rejected == 0,
    );
}

#[test]
fn an_empty_scene_is_empty() {
    let world = upload(&Scene::default());
    let pixels = session(&world, &eye(), cells(16)).run(&world, 3);
    assert_each(
        "sums of pixels of an empty scene",
        &pixels,
        "without indirect light and surfaces",
        |pixel| pixel.indirect == Vec3::ZERO && pixel.n_surfaces == 0,
    );
}

/// Only a lamp of emissive triangles: its light is reflected as the path tracer says, within 15 % on average.
#[test]
fn an_emissive_surface_lights_the_room() {
    let mut meshes = room([2.0, 1.0, 3.0], 0);
    meshes.push(crate::support::quad(
        [[0.8, 0.95, 1.3], [1.2, 0.95, 1.3], [1.2, 0.95, 1.7], [0.8, 0.95, 1.7]],
        1,
    ));
    let lamp = Material { emission: Vec3::splat(8.0), ..lambert([0.0; 3]) };
    let world = upload(&scene(meshes, vec![lambert([0.6, 0.5, 0.4]), lamp]));
    let mut session = session(&world, &eye(), cells(32));
    session.run(&world, 40);
    let found = session.mean(&world, 16, Channel::Indirect);
    let settings =
        settings!(ReferenceSettings { n_bounces: 12, ..crate::support::settings(SIDE, SIDE, 0) });
    let sums = crate::support::render(&world, &eye(), &settings, 256);
    let traced = resolve(&sums, UVec2::splat(SIDE), Channel::Indirect).rgb;
    let expected = traced.iter().map(|v| v.as_dvec3()).sum::<glam::DVec3>() / traced.len() as f64;
    let ratio = found / expected;
    eprintln!("lamp: {ratio} of the path tracer's light");
    assert!(
        (ratio - 1.0).largest() < 0.15,
        "mean indirect light of a lamp is {found}, expected the path tracer's {expected} within 15 %"
    );
}

/// A floor and a low step under an even sky, outdoors: irradiance πL on the open floor within 3 %, with the sky's direct light
/// by rays and by cones.
#[test]
fn a_sky_gives_pi_l_outdoors() {
    let radiance = Vec3::new(0.5, 1.0, 2.0);
    let mut world = scene(vec![floor(10.0, 0.0, 0)], vec![lambert([0.4; 3])]);
    world.sky = Sky::Constant(radiance);
    let world = upload(&world);
    let above = camera([0.0, 3.0, 0.5], [0.0, 0.0, 0.0]);
    for (by_cones, settings) in
        [(false, cells(32)), (false, prefiltered(32)), (true, prefiltered(32))]
    {
        let mut session = session(&world, &above, settings);
        if by_cones {
            crate::shadows::use_cones(&world, &mut session);
        }
        session.irradiance = true;
        session.run(&world, 8);
        let found = session.mean(&world, 16, Channel::Irradiance);
        let ratio = found / (std::f64::consts::PI * radiance.as_dvec3());
        eprintln!("irradiance of the sky, by cones: {by_cones}: {ratio} of πL");
        assert!(
            (ratio - 1.0).largest() < 0.03,
            "irradiance of the sky, by cones: {by_cones}: {ratio} of πL, expected 1 within 0.03"
        );
    }
}

/// Ambient occlusion in a room with blocks against the path tracer's, on average of the picture. Distances are a few cells,
/// and half the room's height: there, cones are as wide as the room's edges are long.
#[test]
fn ambient_occlusion_agrees_with_rays() {
    let mut meshes = room([2.0, 1.0, 3.0], 0);
    for (a, b) in [([0.9, 0.0, 1.2], [1.4, 0.4, 1.7]), ([0.2, 0.0, 1.6], [0.5, 0.8, 1.9])] {
        meshes.extend(block(a, b));
    }
    let world = upload(&scene(meshes, vec![lambert([0.6; 3])]));
    let mut of = [cells(64), prefiltered(64)].map(|of| session(&world, &eye(), of));
    for (which, distance, bound, of_pixels) in
        [(0, 0.2, 0.01, 0.025), (0, 0.5, 0.01, 0.025), (1, 0.2, 0.02, 0.045), (1, 0.5, 0.02, 0.045)]
    {
        let session = &mut of[which];
        session.run(&world, 1);
        session.occlusion_distance = distance;
        let found = session.picture(&world, 32, Channel::Openness);
        let settings = settings!(ReferenceSettings {
            occlusion_distance: distance,
            ..crate::support::settings(SIDE, SIDE, 0)
        });
        let sums = crate::support::render(&world, &eye(), &settings, 512);
        let traced = resolve(&sums, UVec2::splat(SIDE), Channel::Openness).rgb;
        let n = traced.len() as f32;
        let mean = |picture: &[Vec3]| picture.iter().map(|v| v.x).sum::<f32>() / n;
        let error = found.iter().zip(&traced).map(|(a, b)| (a.x - b.x).abs()).sum::<f32>() / n;
        let means = [mean(&found), mean(&traced)];
        eprintln!("openness to {distance} m: {means:?}, mean error {error}");
        assert!(
            means[1] < 0.95,
            "openness to {distance} m by the path tracer is {} on average, expected below 0.95 for a test",
            means[1]
        );
        assert!(
            (means[0] - means[1]).abs() < bound && error < of_pixels,
            "openness to {distance} m is {} on average, expected the path tracer's {} within {bound}; the mean error of pixels is {error}, expected below {of_pixels}",
            means[0],
            means[1]
        );
    }
}

/// A box that faces outwards, without its underside.
fn block(low: [f32; 3], high: [f32; 3]) -> Vec<lucerna::scene::Mesh> {
    let ([a, b, c], [x, y, z]) = (low, high);
    [
        [[a, y, c], [a, y, z], [x, y, z], [x, y, c]],
        [[a, b, z], [x, b, z], [x, y, z], [a, y, z]],
        [[x, b, c], [a, b, c], [a, y, c], [x, y, c]],
        [[x, b, z], [x, b, c], [x, y, c], [x, y, z]],
        [[a, b, c], [a, b, z], [a, y, z], [a, y, c]],
    ]
    .map(|corners| crate::support::quad(corners, 0))
    .to_vec()
}

/// Where the pixels' rays meet a plane through the origin, and how far along the view axis.
fn hit(camera: &Camera, pixel: usize, normal: Vec3) -> Option<Vec3> {
    let half = (0.5f32 * 1.2).tan();
    let place = |ix: usize| (2.0 * (ix as f32 + 0.5) / SIDE as f32 - 1.0) * half;
    let side = SIDE as usize;
    let right = camera.forward.cross(camera.up);
    let direction = camera.forward + place(pixel % side) * right - place(pixel / side) * camera.up;
    let t = -camera.position.dot(normal) / direction.dot(normal);
    (t > 0.0).then(|| camera.position + t * direction)
}

/// Share of the hemisphere, weighted by the cosine, in which a wall at right angles hides what is less than `reach` high (or, at
/// a slant of under 0.3, less than reach/0.3 away), at distance x from the wall: 10⁶ points of the midpoint rule.
fn hidden_by_wall(x: f64, reach: f64) -> f64 {
    let n = 1000;
    let mut sum = 0.0;
    for i in 0..n {
        // u = sin²θ is uniform in the cosine's measure.
        let sine = ((i as f64 + 0.5) / n as f64).sqrt();
        let rise = (1.0 - sine * sine).sqrt();
        for k in 0..n {
            let towards = (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).cos();
            if towards > 0.0 && x / (sine * towards) < reach / rise.max(0.3) {
                sum += 1.0;
            }
        }
    }
    sum / (n * n) as f64
}

/// Occlusion close by, found in the picture: a floor that meets a wall darkens towards it as rays say, within 0.05, in the
/// picture's middle half (at its border, the wall beyond is missing).
#[test]
fn occlusion_close_by_darkens_a_corner_as_rays_say() {
    let wall = [[-5.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 5.0, 0.0], [-5.0, 5.0, 0.0]];
    let meshes = vec![floor(5.0, 0.0, 0), crate::support::quad(wall, 0)];
    let mut world = scene(meshes, vec![lambert([0.6; 3])]);
    let place = Vec3::new(0.0, 2.5, 2.0);
    world.lights.push(Light::Point { position: place, intensity: Vec3::ONE, range: None });
    let world = upload(&world);
    let above = camera([0.0, 1.6, 1.6], [0.0, 0.0, 0.4]);
    let mut reach = 0.0;
    let [with, without] = [true, false].map(|occludes_diffuse| {
        let settings = settings!(VoxelConeSettings { occludes_diffuse, ..prefiltered(20) });
        let mut session = session(&world, &above, settings);
        session.run(&world, 4);
        reach = 1.5 * f64::from(session.technique.grid(0).cell);
        session.picture(&world, 32, Channel::Indirect)
    });
    let mut n_occluded = 0;
    for pixel in 0..with.len() {
        let at = hit(&above, pixel, Vec3::Y).filter(|at| at.z > 0.15 && at.x.abs() < 0.6);
        let Some(at) = at else { continue };
        let open = f64::from(with[pixel].x / without[pixel].x);
        let expected = 1.0 - hidden_by_wall(f64::from(at.z), reach);
        n_occluded += usize::from(expected < 0.9);
        assert!(
            (open - expected).abs() < 0.05,
            "pixel {pixel}, floor at {at}: {open} of indirect light is left in the corner, expected {expected} within 0.05"
        );
    }
    assert!(
        n_occluded > 50,
        "{n_occluded} pixels of the floor are expected to keep below 0.9, expected above 50 of them"
    );
}

/// A floor does not hide itself, however flat it is seen; nor a board before it that is farther than cones reach, not even
/// at its silhouette.
#[test]
fn occlusion_close_by_leaves_open_what_is_open() {
    let board = [[-0.3, 0.9, 0.8], [0.3, 0.9, 0.8], [0.3, 1.2, 0.8], [-0.3, 1.2, 0.8]];
    let meshes = vec![floor(5.0, 0.0, 0), crate::support::quad(board, 0)];
    let world = upload(&scene(meshes, vec![lambert([0.6; 3])]));
    for eye in [[0.0, 1.6, 1.6], [0.0, 0.2, 1.6]] {
        let camera = camera(eye, [0.0, 0.0, -1.0]);
        let settings = settings!(VoxelConeSettings { occludes_diffuse: true, ..prefiltered(64) });
        let mut session = session(&world, &camera, settings);
        session.occlusion_distance = 0.0;
        let picture = session.picture(&world, 16, Channel::Openness);
        let least = picture.iter().map(|pixel| pixel.x).fold(1.0, f32::min_nan);
        assert!(
            least > 0.98,
            "seen from {eye:?}: the least openness of pixels is {least}, expected above 0.98"
        );
    }
}

/// A lone floor has no light but direct light, however its shading normals lean: cones that would lead below it are dark.
#[test]
fn a_lone_floor_does_not_light_itself() {
    let mut mesh = floor(3.0, 0.0, 0);
    mesh.normals = vec![Vec3::new(0.8, 0.6, 0.0); mesh.positions.len()];
    let mut world = scene(vec![mesh], vec![lambert([0.6; 3])]);
    let place = Vec3::new(1.0, 1.5, 0.0);
    world.lights.push(Light::Point { position: place, intensity: Vec3::ONE, range: None });
    let world = upload(&world);
    let mut session = session(&world, &camera([0.0, 1.5, 0.5], [0.0; 3]), cells(32));
    session.run(&world, 4);
    let pixels = session.run(&world, 8);
    let n_lit = pixels.iter().filter(|pixel| pixel.direct.min_element() > 0.0).count();
    assert!(
        n_lit > 0,
        "{n_lit} of {} pixels of a lone floor have direct light, expected some",
        pixels.len()
    );
    assert_each("sums of pixels of a lone floor", &pixels, "without indirect light", |pixel| {
        pixel.indirect == Vec3::ZERO
    });
}

/// A double-sided roof over a floor, with a slit in it over so many cells: how open the floor's middle is.
fn openness_under_slit(n_cells: f32, fills_gaps: bool) -> f64 {
    let half = 2.0;
    let settings = settings!(VoxelConeSettings { fills_gaps, ..prefiltered(32) });
    let make = |[low, high]: [f32; 2]| {
        let part = |a: f32, b: f32| {
            let corners = [[a, 1.0, -half], [a, 1.0, half], [b, 1.0, half], [b, 1.0, -half]];
            crate::support::quad(corners, 1)
        };
        let both = Material { double_sided: true, ..lambert([0.6; 3]) };
        let meshes = vec![floor(half, 0.0, 0), part(-half, low), part(high, half)];
        upload(&scene(meshes, vec![lambert([0.6; 3]), both]))
    };
    // The grid is that of the scene's box, whatever the slit; the slit is a little wider than its cells.
    let grid = *VoxelCone::new(gpu(), &make([0.0; 2]), settings, Vec3::ZERO).unwrap().grid(0);
    let first = (grid.size.x / 2) as f32;
    let edge = |cells: f32| grid.origin.x + (first + cells) * grid.cell;
    let world = make(if n_cells > 0.0 { [edge(-0.01), edge(n_cells + 0.01)] } else { [0.0; 2] });
    let mut session = session(&world, &camera([0.0, 0.9, 0.3], [0.0, 0.0, 0.0]), settings);
    session.occlusion_distance = 10.0;
    session.run(&world, 2);
    session.mean(&world, 8, Channel::Openness).x
}

/// Gap filling closes a slit of a cell, and leaves a wide one open.
#[test]
fn gaps_of_a_cell_are_filled() {
    let closed = openness_under_slit(0.0, false);
    let through = |n_cells| [false, true].map(|fills| openness_under_slit(n_cells, fills) - closed);
    let (narrow, wide) = (through(1.0), through(5.0));
    eprintln!("open through a slit of a cell: {narrow:?}, of 5: {wide:?}");
    assert!(
        narrow[0] > 0.01 && narrow[1] < 0.1 * narrow[0],
        "openness through a slit of a cell is {}, expected above 0.01; with gaps filled {}, expected below 0.1 of that",
        narrow[0],
        narrow[1]
    );
    assert!(
        (wide[1] / wide[0] - 1.0).abs() < 0.02,
        "openness through a slit of 5 cells with gaps filled is {}, expected that without, {}, within 2 %",
        wide[1],
        wide[0]
    );
}

fn leak(settings: VoxelConeSettings, thick: f32, between: Between, shifts: &[f32]) -> Vec<f64> {
    let voxel = 4.0 / 29.0;
    shifts
        .iter()
        .map(|shift| {
            let a = 2.0 + shift * voxel;
            let world = upload(&divided_room([a, a + thick * voxel], between));
            dark_over_lit(between, |camera| {
                let mut session = session(&world, camera, settings);
                session.run(&world, 20);
                session.mean(&world, 8, Channel::Indirect).x
            })
        })
        .collect()
}

/// The places of `voxel-rt`'s leaks (tests/voxel_rt/edges.rs). From surfel to surfel hardly any light gets through; an open door
/// lets as much through as rays say, 17.5 %. Through prefiltered cells more leaks: an opaque voxel lets 4 % pass, steps cut its
/// depth, and cones up to 5 % open are closed; bounds of what was found.
#[test]
fn walls_keep_light_out() {
    let (exact, filtered) = (cells(32), prefiltered(32));
    for (settings, between, thick, shifts, range) in [
        (exact, Between::Wall, 0.3, &[0.0, 0.6][..], 0.0..0.01),
        (exact, Between::Wall, 0.0, &[0.0], 0.0..0.01),
        (exact, Between::Corner, 0.3, &[0.6], 0.0..0.005),
        (exact, Between::Door, 0.3, &[0.6], 0.165..0.19),
        (filtered, Between::Wall, 0.3, &[0.0, 0.6], 0.0..0.1),
        (filtered, Between::Wall, 0.0, &[0.0], 0.0..0.1),
        (filtered, Between::Corner, 0.3, &[0.6], 0.0..0.02),
        (filtered, Between::Door, 0.3, &[0.6], 0.14..0.28),
    ] {
        let leaks = leak(settings, thick, between, shifts);
        eprintln!("{between:?} of {thick} voxels: {leaks:.4?}");
        assert_each(
            &format!("light behind {between:?} of {thick} voxels, relative to the lit room"),
            &leaks,
            &format!("within {range:?}"),
            |leak| range.contains(leak),
        );
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let world = upload(&lit_room());
    let base = VoxelConeSettings::default();
    let stepping = |stepping| settings!(VoxelConeSettings { stepping, ..base });
    let usual = ConeStepping::default();
    for settings in [
        settings!(VoxelConeSettings { n_cones: 4, ..base }),
        settings!(VoxelConeSettings { n_bounce_cones: 0, ..base }),
        settings!(VoxelConeSettings { bounce_period: 0, ..base }),
        settings!(VoxelConeSettings { bounces: Bounces::UpTo(0), ..base }),
        settings!(VoxelConeSettings { specular: Specular::Fixed(120.0), ..prefiltered(32) }),
        // These need prefiltered cells.
        settings!(VoxelConeSettings { specular: Specular::Fixed(10.0), ..base }),
        settings!(VoxelConeSettings { anisotropic: false, ..base }),
        stepping(ConeStepping { step_scale: 0.0, ..usual }),
        stepping(ConeStepping { mip_bias: f32::NAN, ..usual }),
        stepping(ConeStepping { opacity_threshold: 0.0, ..usual }),
        stepping(ConeStepping { start_cells: -1.0, ..usual }),
        settings!(VoxelConeSettings { resolution: Resolution::Longest(257), ..base }),
        settings!(VoxelConeSettings { levels: Levels::Nested(7), ..base }),
        settings!(VoxelConeSettings { bounces: Bounces::UpTo(65), ..base }),
        settings!(VoxelConeSettings { points_per_face: 0, ..base }),
    ] {
        let error = VoxelCone::new(gpu(), &world, settings, Vec3::ZERO).unwrap_err();
        assert!(
            matches!(error, TechniqueError::Setting(_)),
            "{settings:?}: the error is `{error}`, expected one of the settings"
        );
    }
}
