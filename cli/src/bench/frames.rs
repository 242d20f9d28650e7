// SPDX-License-Identifier: MIT OR Apache-2.0
//! Times the passes of several configurations, which render frames in turn.

use glam::{UVec2, Vec3};
use lucerna::blocking::read_buffer;
use lucerna::frame::{DirectSettings, FramePasses, View, ViewSettings};
use lucerna::gpu::{Gpu, PassTimers, Recorder};
use lucerna::gpu_scene::{GpuScene, WorldTriangles};
use lucerna::scene::{Camera, Light, Scene};
use lucerna::seam::{Change, Revised, Revisions};
use lucerna::techniques::Technique;
use std::error::Error;

/// The picture size of the techniques' sources.
pub const PICTURE: UVec2 = UVec2::new(1920, 1080);
/// The fastest of this many frames counts.
const ROUNDS: u32 = 5;
/// Frames until dark faces are rarely sampled.
const FRAMES_TO_SETTLE: u32 = 24;

/// Fastest time of each pass \[ms\]; passes of the same name in a frame are added up.
pub type Passes = Vec<(&'static str, f64)>;

/// What every configuration has in common.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    pub gpu: &'a Gpu,
    pub scene: &'a GpuScene,
    pub camera: &'a Camera,
}

/// One configuration and its state.
pub struct Rig<T> {
    pub technique: T,
    pub passes: FramePasses,
    view: View,
    revisions: Revisions,
    best: Passes,
}

/// A scene without any light gets a point light in the middle of its box.
pub fn with_light(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if scene.lights.is_empty() && scene.materials.iter().all(|m| m.emission == Vec3::ZERO) {
        let (low, high) = WorldTriangles::of(&scene).bounds();
        let intensity = Vec3::splat((high - low).length_squared());
        scene.lights.push(Light::Point { position: 0.5 * (low + high), intensity, range: None });
    }
    scene
}

/// Milliseconds that the passes of these names took together; a pass that did not run counts 0.
pub fn sum_of(passes: &Passes, names: &[&str]) -> f64 {
    passes.iter().filter(|(name, _)| names.contains(name)).map(|(_, ms)| ms).sum()
}

impl Bench<'_> {
    /// A picture of a technique.
    pub fn rig<T>(&self, size: UVec2, technique: T) -> Result<Rig<T>, Box<dyn Error>> {
        Ok(Rig {
            technique,
            passes: FramePasses::new(self.gpu, self.scene, size, DirectSettings::default())?,
            view: View::new(size),
            revisions: Revisions::fresh(),
            best: Vec::new(),
        })
    }

    /// The passes of each configuration. Passes that run because something has moved are timed in frames in which
    /// everything moved, the others in frames in which nothing did. The configurations take turns, so that a
    /// disturbance affects all of them.
    ///
    /// `moving`: passes that run only when something has moved.
    pub fn run<T: Technique>(
        &self,
        rigs: &mut [Rig<T>],
        moving: &[&'static str],
    ) -> Result<Vec<Passes>, Box<dyn Error>> {
        let mut timers = PassTimers::new(self.gpu)
            .ok_or("this device has no timestamps: passes can't be timed")?;
        for frame_ix in 0..1 + ROUNDS + FRAMES_TO_SETTLE + ROUNDS {
            for rig in rigs.iter_mut() {
                self.frame(rig, frame_ix, &mut timers, moving)?;
            }
        }
        Ok(rigs.iter_mut().map(|rig| std::mem::take(&mut rig.best)).collect())
    }

    fn frame<T: Technique>(
        &self,
        rig: &mut Rig<T>,
        frame_ix: u32,
        timers: &mut PassTimers,
        moving: &[&'static str],
    ) -> Result<(), Box<dyn Error>> {
        // The first frame compiles.
        let is_moved = frame_ix <= ROUNDS;
        let is_settled = frame_ix > ROUNDS + FRAMES_TO_SETTLE;
        if is_moved {
            rig.revisions = rig.revisions.changed(Change::Geometry);
        }
        let scene = &Revised { scene: self.scene, revisions: rig.revisions };
        rig.view.advance(scene, self.camera, &ViewSettings::default());
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        timers.begin_frame();
        {
            let recorder = &mut Recorder::timed(self.gpu, &mut encoder, Some(timers));
            if frame_ix == 0 || is_settled {
                rig.passes.record(recorder, scene, &rig.view, &mut rig.technique)?;
            } else {
                rig.passes.update(recorder, scene, &rig.view, &mut rig.technique)?;
            }
        }
        timers.resolve(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let bytes = read_buffer(self.gpu, timers.resolved())?;
        let mut of_frame: Passes = Vec::new();
        for (name, ms) in timers.milliseconds(&bytes) {
            match of_frame.iter_mut().find(|(known, _)| *known == name) {
                Some((_, sum)) => *sum += ms,
                None => of_frame.push((name, ms)),
            }
        }
        let counts = |name: &str| match moving.contains(&name) {
            true => is_moved && frame_ix > 0,
            false => is_settled,
        };
        for (name, ms) in of_frame.into_iter().filter(|(name, _)| counts(name)) {
            match rig.best.iter_mut().find(|(known, _)| *known == name) {
                Some((_, least)) => *least = least.min(ms),
                None => rig.best.push((name, ms)),
            }
        }
        Ok(())
    }
}
