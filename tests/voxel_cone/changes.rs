// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lights and objects that change between frames: each change is a `GpuScene` built anew.

use crate::session::{Session, camera, upload};
use crate::support::{floor, lambert, room, scene};
use crate::{cells, session};
use glam::{Affine3A, Vec3};
use lucerna::scene::{Camera, Light, Scene};
use lucerna::seam::Change;
use lucerna::settings;
use lucerna::techniques::reference::Channel;
use lucerna::techniques::voxel_cone::{VoxelCone, VoxelConeSettings};

/// A closed grey room with a point light and a board at x.
fn room_with_board(x: f32, intensity: f32) -> Scene {
    let mut meshes = room([4.0, 2.0, 4.0], 0);
    let board = meshes.len();
    meshes.push(floor(0.4, 0.0, 1));
    let mut world = scene(meshes, vec![lambert([0.6; 3]), lambert([0.9, 0.1, 0.1])]);
    world.materials[1].double_sided = true;
    let upright = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    world.instances[board].world_from_object =
        Affine3A::from_translation(Vec3::new(x, 0.8, 0.7)) * upright;
    world.lights.push(Light::Point {
        position: Vec3::new(0.6, 1.6, 1.0),
        intensity: Vec3::splat(intensity),
        range: None,
    });
    world
}

fn eye() -> Camera {
    camera([2.0, 1.2, 3.6], [2.0, 0.7, 0.3])
}

fn mean(session: &mut Session<VoxelCone>, world: &lucerna::gpu_scene::GpuScene, n: u32) -> f64 {
    session.mean(world, n, Channel::Indirect).y
}

/// A light that goes out: direct light of faces counts one frame alone for four frames, and with a period of 1 each frame
/// reflects what is left once more, ρ = 0.6 of it at most. After 16 frames less than 0.6¹² = 0.2 % is left.
#[test]
fn a_light_that_goes_out_leaves_nothing() {
    let lit = upload(&room_with_board(2.0, 5.0));
    let dark = upload(&room_with_board(2.0, 0.0));
    let settings = settings!(VoxelConeSettings { bounce_period: 1, ..cells(24) });
    let mut session = session(&lit, &eye(), settings);
    session.run(&lit, 24);
    let before = mean(&mut session, &lit, 4);
    session.changed(Change::Lights);
    session.run(&dark, 16);
    let after = mean(&mut session, &dark, 1);
    eprintln!("{before}, and 17 frames after the light went out {after}");
    assert!(
        before > 0.01 && after < 0.002 * before,
        "mean indirect light 17 frames after the light has gone out is {after}, expected below 0.002 of {before}, which is expected above 0.01"
    );
}

/// An object that moves: 12 frames later the picture is within 5 % of a session that began with it there.
#[test]
fn a_moved_board_is_where_it_is() {
    let (here, there) = (room_with_board(1.0, 5.0), room_with_board(3.0, 5.0));
    let (here, there) = (upload(&here), upload(&there));
    let settings = settings!(VoxelConeSettings {
        points_per_face: 4,
        n_cones: 16,
        n_bounce_cones: 16,
        ..cells(24)
    });
    let picture = |session: &mut Session<VoxelCone>| session.picture(&there, 16, Channel::Indirect);
    let settled = {
        let mut session = session(&there, &eye(), settings);
        session.run(&there, 32);
        picture(&mut session)
    };
    let mut session = session(&here, &eye(), settings);
    session.run(&here, 32);
    let old = session.picture(&here, 16, Channel::Indirect);
    session.changed(Change::Moving);
    session.run(&there, 12);
    let new = picture(&mut session);
    let apart = |a: &[Vec3], b: &[Vec3]| {
        let sum: f32 = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().element_sum()).sum();
        sum / b.iter().map(|b| b.element_sum()).sum::<f32>()
    };
    let (moved, left) = (apart(&old, &settled), apart(&new, &settled));
    eprintln!("the move changed {moved}, 12 frames later {left} is left");
    assert!(
        moved > 0.04 && left < 0.05 && left < 0.5 * moved,
        "the move changes the picture by {moved}, expected above 0.04; 12 frames later {left} is left, expected below 0.05 and below half of that"
    );
}
