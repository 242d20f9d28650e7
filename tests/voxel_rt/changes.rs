// SPDX-License-Identifier: MIT OR Apache-2.0
//! Lights and objects that change between frames: each change is a `GpuScene` built anew.

use crate::harness::Largest;
use crate::session::{Session, camera, upload};
use crate::support::{floor, lambert, room, scene};
use glam::{Affine3A, DVec3, Vec3};
use lucerna::components::voxel_light::{DirectLight, RaysInjected};
use lucerna::scene::{Camera, Light, Scene};
use lucerna::seam::Change;
use lucerna::settings;
use lucerna::techniques::reference::Channel;
use lucerna::techniques::voxel_rt::VoxelRtSettings;

/// A closed grey room of 4 m × 2 m × 4 m with a point light, and a red board that hangs before a wall.
fn board_at(x: f32, light: [f32; 3]) -> Scene {
    let mut meshes = room([4.0, 2.0, 4.0], 0);
    let board = meshes.len();
    meshes.push(floor(0.4, 0.0, 1));
    let mut world = scene(meshes, vec![lambert([0.6; 3]), lambert([0.9, 0.1, 0.1])]);
    let upright = Affine3A::from_rotation_x(-std::f32::consts::FRAC_PI_2);
    world.instances[board].world_from_object =
        Affine3A::from_translation(Vec3::new(x, 0.8, 0.7)) * upright;
    world.lights.push(Light::Point {
        position: light.into(),
        intensity: Vec3::new(4.0, 5.0, 6.0),
        range: None,
    });
    world
}

fn eye() -> Camera {
    camera([2.0, 1.2, 3.6], [2.0, 0.7, 0.3])
}

fn settings() -> VoxelRtSettings {
    settings!(VoxelRtSettings { resolution: 24, points_per_face: 4, ..Default::default() })
}

/// The largest difference of a channel, relative.
fn apart(a: DVec3, b: DVec3) -> f64 {
    ((a - b) / b).largest()
}

/// Eight frames after a light has moved, the picture's mean indirect light is within 5 % of what it
/// settles to; and it had been elsewhere.
#[test]
fn a_moved_light_arrives_within_eight_frames() {
    let settings = settings!(VoxelRtSettings { points_per_face: 1, ..settings() });
    let (before, after) = (board_at(2.0, [0.6, 1.6, 1.0]), board_at(2.0, [3.4, 0.3, 3.0]));
    let (before, after) = (upload(&before), upload(&after));
    let settled = {
        let mut session = Session::new(&after, &eye(), settings);
        session.run(&after, 96);
        session.mean(&after, 32, Channel::Indirect)
    };
    let mut session = Session::new(&before, &eye(), settings);
    session.run(&before, 96);
    let old = session.mean(&before, 8, Channel::Indirect);
    session.changed(Change::Lights);
    session.run(&after, 7);
    let new = session.mean(&after, 1, Channel::Indirect);
    eprintln!("from {old} to {settled}; after 8 frames {new}");
    assert!(
        apart(old, settled) > 0.1,
        "indirect light from before is {old}, with the moved light {settled}: a relative change of {:.4}, expected above 0.1 for a test",
        apart(old, settled)
    );
    assert!(
        apart(new, settled) < 0.05,
        "indirect light 8 frames after the light has moved is {new}, expected {settled} within 5 %"
    );
}

/// A light that goes out leaves nothing behind, wherever its light came from.
#[test]
fn a_light_that_goes_out_leaves_no_light() {
    let rays = lucerna::settings!(RaysInjected { n_rays: 64, ..Default::default() });
    for direct in
        [DirectLight::PerFace, DirectLight::FromLights(rays), DirectLight::FromCamera(rays)]
    {
        light_goes_out(settings!(VoxelRtSettings { direct, ..settings() }));
    }
}

fn light_goes_out(settings: VoxelRtSettings) {
    let lit = board_at(2.0, [2.0, 1.6, 2.5]);
    let mut dark = lit.clone();
    dark.lights.clear();
    let (lit, dark) = (upload(&lit), upload(&dark));
    let mut session = Session::new(&lit, &eye(), settings);
    let before = session.mean(&lit, 24, Channel::Indirect).max_element();
    session.changed(Change::Lights);
    session.run(&dark, 15);
    let after = session.mean(&dark, 1, Channel::Indirect).max_element();
    assert!(
        before > 0.01,
        "{:?}: indirect light before the light goes out is {before}, expected above 0.01",
        settings.direct
    );
    assert!(
        after < 0.01 * before,
        "{:?}: indirect light 16 frames after the light has gone out is {after}, expected below 0.01 of {before}",
        settings.direct
    );
}

/// Sixteen frames after the board has moved, the picture is that of a technique which never knew it
/// elsewhere: pixel by pixel no ghost, neither of its red light nor of its shadow.
fn leaves_no_ghost(change: Change) {
    let light = [2.0, 1.6, 3.2];
    let (before, after) = (upload(&board_at(0.9, light)), upload(&board_at(3.1, light)));
    let mut fresh = Session::new(&after, &eye(), settings());
    fresh.run(&after, 96);
    let settled = fresh.picture(&after, 16, Channel::Indirect);
    let mut session = Session::new(&before, &eye(), settings());
    session.run(&before, 96);
    let old = session.picture(&before, 8, Channel::Indirect);
    session.changed(change);
    session.run(&after, 16);
    let new = session.picture(&after, 16, Channel::Indirect);
    let bright = settled.iter().map(|p| p.max_element()).fold(0.0, f32::max);
    let difference = |a: &[Vec3]| {
        let squares = a.iter().zip(&settled).map(|(a, b)| f64::from((a - b).length_squared()));
        (squares.sum::<f64>() / settled.len() as f64).sqrt() / f64::from(bright)
    };
    eprintln!("{change:?}: before {:.4}, after {:.4}", difference(&old), difference(&new));
    assert!(
        difference(&old) > 0.05,
        "{change:?}: pictures before and after the board's move differ by {:.4}, expected above 0.05 for a test",
        difference(&old)
    );
    // 30 frames of 4 points a face against 112: noise, a tenth of the difference.
    assert!(
        difference(&new) < 0.2 * difference(&old),
        "{change:?}: the picture differs from the settled one by {:.4}, expected below 0.2 of the {:.4} from before the move",
        difference(&new),
        difference(&old)
    );
}

#[test]
fn a_moving_object_leaves_no_ghost() {
    leaves_no_ghost(Change::Moving);
}

#[test]
fn changed_geometry_leaves_no_ghost() {
    leaves_no_ghost(Change::Geometry);
}
