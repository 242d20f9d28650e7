// SPDX-License-Identifier: MIT OR Apache-2.0
//! Frames of a technique over scenes that may change between them.

use crate::harness::{gpu, read, submit};
use crate::support::{lambert, room, scene};
use glam::{DVec3, UVec2, Vec3};
use lucerna::frame::{DirectSettings, FramePasses, View, ViewSettings};
use lucerna::gpu_scene::{GpuScene, GpuSceneOptions};
use lucerna::scene::{Camera, Light, Projection, Scene};
use lucerna::seam::{Change, Revised, Revisions};
use lucerna::settings;
use lucerna::techniques::Technique;
use lucerna::techniques::reference::{Channel, PixelSums, resolve};
use lucerna::techniques::voxel_rt::{VoxelRt, VoxelRtSettings};

pub const SIDE: u32 = 24;

/// A scene on the GPU, every material Lambert; the last instance carries the mark of moving ones.
pub fn upload(scene: &Scene) -> GpuScene {
    let options = settings!(GpuSceneOptions { diffuse_only: true, ..Default::default() });
    let last = scene.instances.len().saturating_sub(1);
    GpuScene::with_moving(gpu(), scene, options, &|instance| instance == last).unwrap()
}

/// A room of 2 m × 1 m × 3 m with a point light.
pub fn lit_room() -> Scene {
    let mut world = scene(room([2.0, 1.0, 3.0], 0), vec![lambert([0.6, 0.5, 0.4])]);
    world.lights.push(Light::Point {
        position: Vec3::new(1.1, 0.8, 1.3),
        intensity: Vec3::ONE,
        range: None,
    });
    world
}

pub fn camera(eye: [f32; 3], target: [f32; 3]) -> Camera {
    let position = Vec3::from(eye);
    let forward = (Vec3::from(target) - position).normalize();
    let right = forward.cross(Vec3::Y).normalize();
    Camera {
        name: String::new(),
        position,
        forward,
        up: right.cross(forward),
        projection: Projection::Perspective { vertical_fov: 1.2 },
    }
}

/// A technique under way.
pub struct Session<T> {
    pub technique: T,
    /// May be put elsewhere between frames.
    pub camera: Camera,
    /// Whether the picture's irradiance is asked for.
    pub irradiance: bool,
    /// How far ambient occlusion looks [m].
    pub occlusion_distance: f32,
    pub passes: FramePasses,
    view: View,
    /// Scenes are taken for one and the same, unless something is said to have changed.
    revisions: Revisions,
}

impl Session<VoxelRt> {
    pub fn new(scene: &GpuScene, camera: &Camera, settings: VoxelRtSettings) -> Self {
        let technique = VoxelRt::new(gpu(), scene, settings, camera.position).unwrap();
        Self::of(scene, camera, technique)
    }
}

impl<T: Technique> Session<T> {
    pub fn of(scene: &GpuScene, camera: &Camera, technique: T) -> Self {
        let size = UVec2::splat(SIDE);
        Self {
            technique,
            camera: camera.clone(),
            irradiance: false,
            occlusion_distance: 1.0,
            passes: FramePasses::new(gpu(), scene, size, DirectSettings::default()).unwrap(),
            view: View::new(size),
            revisions: Revisions::fresh(),
        }
    }

    /// Says what has changed between the scenes of the last and the next frame.
    pub fn changed(&mut self, change: Change) {
        self.revisions = self.revisions.changed(change);
    }

    /// The next frames; returns the sums of their pixels.
    pub fn run(&mut self, scene: &GpuScene, n_frames: u32) -> Vec<PixelSums> {
        let settings = settings!(ViewSettings {
            n_accumulated: n_frames,
            irradiance: self.irradiance,
            occlusion_distance: self.occlusion_distance,
            ..ViewSettings::default()
        });
        self.passes.accumulator.reset();
        for _ in 0..n_frames {
            let scene = &Revised { scene, revisions: self.revisions };
            self.view.advance(scene, &self.camera, &settings);
            let (view, technique) = (&self.view, &mut self.technique);
            submit(|recorder| self.passes.record(recorder, scene, view, technique)).unwrap();
        }
        let stripes = self.passes.accumulator.film().stripes();
        assert_eq!(stripes.len(), 1, "stripes of the film");
        bytemuck::pod_collect_to_vec(&read(&stripes[0].sums))
    }

    /// The next frames' picture of a channel.
    pub fn picture(&mut self, scene: &GpuScene, n_frames: u32, channel: Channel) -> Vec<Vec3> {
        resolve(&self.run(scene, n_frames), UVec2::splat(SIDE), channel).rgb
    }

    /// The mean of a channel over the picture.
    pub fn mean(&mut self, scene: &GpuScene, n_frames: u32, channel: Channel) -> DVec3 {
        let picture = self.picture(scene, n_frames, channel);
        picture.iter().map(|pixel| pixel.as_dvec3()).sum::<DVec3>() / picture.len() as f64
    }
}
