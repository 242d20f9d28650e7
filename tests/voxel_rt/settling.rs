// SPDX-License-Identifier: MIT OR Apache-2.0
//! Techniques say how much of their light is still on its way, and `render_frames` ends a warm-up by it.

use crate::harness::gpu;
use crate::session::{Session, upload};
use crate::support::{lambert, room, scene};
use glam::UVec2;
use lucerna::blocking::{FramesToRender, read_light_to_come, render_frames};
use lucerna::gpu_scene::GpuScene;
use lucerna::scene::{Camera, Light, Scene};
use lucerna::seam::Change;
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::Channel;

/// A room of this albedo, closed, with a lamp.
pub fn lit(albedo: f32) -> Scene {
    let mut scene = scene(room([2.0, 1.0, 2.0], 0), vec![lambert([albedo; 3])]);
    scene.lights.push(Light::Point {
        position: glam::Vec3::new(0.5, 0.7, 0.6),
        intensity: glam::Vec3::ONE,
        range: None,
    });
    scene
}

/// Light that is said to have settled within 0.5 % lacks less than 2.5 %, of which 1 % is the noise of the means (as seen between seeds); brighter rooms
/// take longer. A light that is moved begins anew. `start`: with this seed.
pub fn what_is_told_arrives<T: Technique>(start: &dyn Fn(&GpuScene, &Camera, u32) -> Session<T>) {
    let eye = crate::session::camera([1.6, 0.8, 1.7], [0.4, 0.3, 0.2]);
    let mut frames_to_settle = Vec::new();
    for albedo in [0.2, 0.8] {
        let world = upload(&lit(albedo));
        // The mean over seeds, of this many frames after so many others.
        let mean = |n_seeds: u32, n_before, n_frames| {
            let means = (1..=n_seeds).map(|seed| {
                let mut session = start(&world, &eye, seed);
                session.run(&world, n_before);
                session.mean(&world, n_frames, Channel::Indirect) / f64::from(n_seeds)
            });
            means.sum::<glam::DVec3>()
        };
        let mut session = start(&world, &eye, 0);
        let mut n = 0;
        let to_come = loop {
            session.run(&world, 1);
            n += 1;
            let told = read_light_to_come(gpu(), &session.technique).unwrap();
            assert!(n >= 8 || told.is_none(), "albedo {albedo}: {told:?} is told after {n} frames");
            match told {
                Some(share) if share < 0.005 && n >= 8 => break f64::from(share),
                _ => assert!(n < 256, "albedo {albedo}: {told:?} still on its way"),
            }
        };
        let (now, end) = (mean(8, n, 2), mean(2, 128, 48));
        let lacks = 1.0 - (now / end).min_element();
        println!("albedo {albedo}: {n} frames, {to_come:.4} on its way, {lacks:.4} is missing");
        assert!(
            lacks < 0.025,
            "albedo {albedo}: after {n} frames {to_come:.4} is said to be on its way, but {lacks:.4} of the light is missing"
        );
        frames_to_settle.push(n);
        session.changed(Change::Lights);
        session.run(&world, 1);
        let told = read_light_to_come(gpu(), &session.technique).unwrap();
        assert_eq!(told, None, "light to come in the first frame after a change");
    }
    assert!(
        frames_to_settle[0] < frames_to_settle[1],
        "a dark and a bright room settle in {frames_to_settle:?} frames"
    );
}

/// A warm-up ends when the light has settled; without a limit it has all its frames, and one that is too short says what is
/// missing.
pub fn a_warm_up_ends_when_it_may<T: Technique>(
    start: &dyn Fn(&GpuScene, &Camera, u32) -> Session<T>,
) {
    let eye = crate::session::camera([1.6, 0.8, 1.7], [0.4, 0.3, 0.2]);
    let world = upload(&lit(0.8));
    let run = |n_warm_up, settled_below| {
        let mut technique = start(&world, &eye, 0).technique;
        let what = settings!(FramesToRender {
            n_warm_up,
            settled_below,
            ..FramesToRender::new(UVec2::splat(8), 2)
        });
        let mut shown = Vec::new();
        let (_, stats) = render_frames(gpu(), &world, &eye, &what, &mut technique, |progress| {
            shown.push(progress);
            true
        })
        .unwrap();
        let last = shown.last().unwrap();
        assert_eq!(last.done, last.total, "progress at the end");
        assert_eq!(last.done, u64::from(stats.n_warm_up + 2), "frames in all");
        stats
    };
    let ended = run(200, 0.005);
    let to_come = ended.light_to_come.unwrap();
    assert!(
        (8..200).contains(&ended.n_warm_up) && to_come < 0.005,
        "of 200 frames it took {} until {to_come} was on its way, expected fewer, and below 0.005",
        ended.n_warm_up
    );
    let whole = run(ended.n_warm_up + 9, 0.0);
    assert_eq!(whole.n_warm_up, ended.n_warm_up + 9, "frames without a limit");
    let short = run(8, 0.005);
    assert!(
        short.n_warm_up == 8 && short.light_to_come.unwrap() > 0.005,
        "eight frames: {} with {:?} on its way, expected 8 with more than 0.005",
        short.n_warm_up,
        short.light_to_come
    );
    assert_eq!(run(2, 0.005).light_to_come, None, "light to come after two frames");
}
