// SPDX-License-Identifier: MIT OR Apache-2.0
//! Light of voxels: irradiance that is stored for the faces of the voxels that contain surfaces, in nested grids around
//! the eye. The method is described in `docs/techniques/voxel-rt.md`.
//!
//! ```text
//! Voxelizer ──structure──▶ CarryPass ──▶ GatherPass (every frame) ──▶ PublishPass ──▶ reflected, shown
//!  when something moved     keeps what     rays from the faces of        for bounces, for pictures
//!  or the grid scrolled     is known       voxels
//! ```
//!
//! Faces sample their direct light themselves; or [`VoxelInjector`] deposits it by rays from lights or the camera
//! ([`DirectLight`]) with one of four [`WriteStrategy`]s, before the gathering.

mod cache;
mod deposit;
mod gather;
mod inject;
mod level_pass;
mod levels;
pub(crate) mod setting;
mod settings;
mod sides;
mod structure;
mod write;

use crate::bindings::lucerna::camera::primary_ray::Camera;
use crate::bindings::lucerna::components::voxel_light::accumulator::{
    HEAD_CLAMPED, HEAD_CUT, HEAD_OUTSIDE, HEAD_REJECTED,
};
use crate::components::LightVisibility;
use crate::components::convergence::Convergence;
use crate::components::voxels::{
    RECORD_GROUPS_OFFSET, Triangles, VoxelError, VoxelGrid, Voxelizer, n_bricks,
};
use crate::gpu::{Dispatch, Gpu, GpuError, Recorder, Shaders};
use crate::report::{Notice, Stat};
use crate::seam::{Mismatch, Revisions, SceneSeam, check_shaders};
use glam::{IVec3, UVec3, Vec3};
use levels::{MAX_LEVELS, corner_around};
use std::mem::offset_of;

pub use crate::bindings::kernels::voxel_light::inject::RUN_SIDE;
pub use crate::bindings::lucerna::components::voxel_light::cache::{FaceLight, SETTLED_PERIOD};
pub use crate::bindings::lucerna::components::voxels::levels::{VoxelLevel, VoxelLevels};
pub use crate::bindings::lucerna::fields::voxel_accumulators::VoxelSample;
pub use cache::CacheBuffers;
pub use deposit::DepositPass;
pub use gather::{GatherInfo, GatherPass};
pub use inject::{Injection, InjectionSource, VoxelInjector};
pub use level_pass::{CarryInfo, CarryPass, LevelInfo, LevelPass, PublishInfo, PublishPass};
pub use levels::VoxelReach;
pub use settings::{Bounces, DirectLight, Levels, RaysInjected, VoxelLightSettings};
pub use sides::SidesPass;
pub use structure::sparse_grid;
pub use write::{InjectError, RejectedSamples, VoxelIrradiance, WriteStrategy};

/// The voxels' light could not be created, or could not be updated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VoxelLightError {
    /// A setting is out of range.
    #[error("{name} is {value}; possible values: {possible}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: String,
        /// What may be given.
        possible: &'static str,
    },
    /// Rays from the camera were requested, but the eye has no camera.
    #[error("rays from the camera need a camera: make the eye from a view")]
    NoCamera,
    /// The scene differs from the one that this was made for.
    #[error(transparent)]
    Mismatch(#[from] Mismatch),
    /// The grid.
    #[error(transparent)]
    Voxel(#[from] VoxelError),
    /// Rays that deposit light.
    #[error(transparent)]
    Inject(#[from] InjectError),
    /// A limit of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The point from which the scene is seen. Nested grids follow it.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// \[m\]
    pub position: Vec3,
    /// The camera, for rays from it ([`DirectLight::FromCamera`]).
    pub camera: Option<Camera>,
}

impl Eye {
    /// Only a position \[m\].
    pub fn at(position: Vec3) -> Self {
        Self { position, camera: None }
    }

    /// A camera, as kernels have it.
    pub fn of_camera(camera: Camera) -> Self {
        Self { position: camera.position, camera: Some(camera) }
    }
}

/// What to do if a driver ends loops early.
const LOOPS_ENDED: &str =
    "this driver ends loops after 65535 iterations: use fewer points, bounces or cones";

/// Rays over which a face averages what is in its cell, while things move.
const RAYS_WHILE_MOVING: u32 = 8;

/// Frames after a change in which nothing older than a frame counts: light that is reflected repeatedly needs this many
/// to arrive.
const FRAMES_WITHOUT_HISTORY: u32 = 4;

/// Where in [`CacheBuffers::levels`] it says whether the light has settled.
const IS_SETTLED_AT: u64 = offset_of!(VoxelLevels, is_settled) as u64;

/// Voxels of a scene and the light that their faces receive.
#[derive(Debug)]
pub struct VoxelLight {
    settings: VoxelLightSettings,
    shaders: Shaders,
    levels: Vec<Level>,
    layout: VoxelLevels,
    buffers: CacheBuffers,
    /// None: faces sample their direct light themselves.
    deposit: Option<DepositPass>,
    gather: GatherPass,
    carry: CarryPass,
    /// None: a grid with one value per voxel knows no sides.
    sides: Option<SidesPass>,
    publish: PublishPass,
    /// Revisions of the scene at the last update; None before the first one.
    seen: Option<Revisions>,
    frames_since_change: u32,
    frames_since_motion: u32,
    n_frames: u32,
    convergence: Convergence,
    /// Which levels the last update gave a new structure.
    new_levels: [bool; MAX_LEVELS as usize],
    reach: VoxelReach,
}

/// One grid.
#[derive(Debug)]
struct Level {
    voxelizer: Voxelizer,
    /// The cell of the world's grid of this size at which the level starts, if it follows the eye.
    corner: IVec3,
}

impl Level {
    /// One invocation per face.
    fn records(&self) -> Dispatch<'_> {
        Dispatch::Indirect(self.voxelizer.counts(), RECORD_GROUPS_OFFSET)
    }
}

impl VoxelLight {
    /// Creates the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// `visibility`: how faces find out which lights they see. `eye` \[m\]: the camera's position; the levels are laid
    /// out for what can be seen from there.
    ///
    /// # Errors
    /// [`VoxelLightError`]: a setting is out of range, or a buffer is larger than the device can bind.
    pub fn new(
        gpu: &Gpu,
        scene: &dyn SceneSeam,
        settings: VoxelLightSettings,
        visibility: &LightVisibility,
        eye: Vec3,
    ) -> Result<Self, VoxelLightError> {
        settings.check()?;
        let n_faces = if settings.anisotropic { 6 } else { 1 };
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        let (grids, reach) = levels::grids(scene, &settings, n_faces, limit, eye)?;
        let mut layout = VoxelLevels {
            levels: [NO_LEVEL; MAX_LEVELS as usize],
            n_levels: grids.len() as u32,
            is_settled: 0,
            reserved_a: 0,
            reserved_b: 0,
        };
        let (mut n_words, mut n_records) = (0, 0);
        let mut levels = Vec::new();
        for (level, (grid, corner)) in grids.into_iter().enumerate() {
            let first_side = n_words + n_bricks(&grid) + grid.capacity;
            layout.levels[level] = VoxelLevel {
                grid,
                first_brick: n_words,
                first_record: n_records,
                first_side,
                ..NO_LEVEL
            };
            n_words =
                first_side + if settings.anisotropic { 2 * grid.capacity * n_faces } else { 0 };
            n_records += grid.capacity * n_faces;
            levels.push(Level { voxelizer: Voxelizer::new(gpu, scene, grid)?, corner });
        }
        let voxelizers = levels.iter().map(|level| &level.voxelizer);
        let deposit = DepositPass::new(gpu, scene, settings.direct, voxelizers)?;
        let records = layout.levels.iter().take(levels.len());
        let convergence =
            Convergence::new(gpu, records.map(|level| level.grid.capacity * n_faces))?;
        Ok(Self {
            settings,
            shaders: scene.shaders().clone(),
            levels,
            deposit,
            gather: GatherPass::new(gpu, scene, visibility),
            carry: CarryPass::new(gpu),
            sides: settings.anisotropic.then(|| SidesPass::new(gpu, scene, settings.divides)),
            publish: PublishPass::new(gpu),
            buffers: CacheBuffers::new(gpu, &layout, n_words, n_records)?,
            layout,
            seen: None,
            frames_since_change: 0,
            frames_since_motion: 0,
            n_frames: 0,
            convergence,
            new_levels: [false; MAX_LEVELS as usize],
            reach,
        })
    }

    /// The voxelizers, from the finest level to the coarsest.
    pub fn voxelizers(&self) -> impl Iterator<Item = &Voxelizer> {
        self.levels.iter().map(|level| &level.voxelizer)
    }

    /// Whether the last [`update`](Self::update) made a new structure, so that voxels have other slots.
    pub fn has_new_structure(&self) -> bool {
        self.new_levels.contains(&true)
    }

    /// As [`has_new_structure`](Self::has_new_structure), for one level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn is_new(&self, level: usize) -> bool {
        self.new_levels[level]
    }

    /// Number of updates so far.
    pub fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Number of nested grids.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// How fine the cells are, compared with what was around the eye when this was made, and what is beyond them.
    pub fn reach(&self) -> &VoxelReach {
        &self.reach
    }

    /// The settings.
    pub fn settings(&self) -> &VoxelLightSettings {
        &self.settings
    }

    /// The grid of a level.
    ///
    /// # Panics
    /// If there is no such level.
    pub fn grid(&self, level: usize) -> &VoxelGrid {
        self.levels[level].voxelizer.grid()
    }

    /// What is kept between frames.
    pub fn buffers(&self) -> &CacheBuffers {
        &self.buffers
    }

    /// What rays from lights or the camera deposit; None if faces sample their direct light themselves.
    pub fn deposit(&self) -> Option<&DepositPass> {
        self.deposit.as_ref()
    }

    /// How the grids were laid out, if there are several, and whether they are too coarse.
    pub fn notices(&self) -> Vec<Notice> {
        let VoxelReach { finest_cell, coarsest_cell, surroundings, is_cut } = self.reach;
        let mut notices = Vec::new();
        let n = self.levels.len();
        if n > 1 {
            let text =
                format!("{n} nested grids, cells of {finest_cell:.3} m to {coarsest_cell:.3} m");
            notices.push(Notice::note(text));
        }
        if is_cut {
            notices.push(Notice::warning(
                "surfaces more than 1024 times as far away as anything that the camera sees have no voxels, and give no indirect light".into(),
            ));
        }
        if let Some(around) = surroundings.filter(|_| self.reach.is_coarse()) {
            let near = around.median;
            notices.push(Notice::warning(format!(
                "the finest voxels are {finest_cell:.3} m wide, but half of what is around the camera is nearer than {near:.3} m: indirect light will be wrong; choose levels `auto`, or more voxels"
            )));
        }
        notices
    }

    /// Statistics: voxels, bytes, and what is wrong.
    pub fn stats(&self) -> Vec<Stat> {
        let of = &self.buffers;
        let kept = [
            &of.structure,
            &of.structure_before,
            &of.lights,
            &of.lights_before,
            &of.reflected,
            &of.shown,
        ];
        let bytes = kept.iter().map(|buffer| buffer.size()).sum();
        let mut stats = vec![Stat::known("light of voxels", "bytes", bytes)];
        for counts in &of.counts {
            let room = "use fewer voxels, or one value per voxel";
            stats.push(Stat::counted("voxels of a level", "voxels", counts, 0));
            stats.push(Stat::counted("without room in a level", "voxels", counts, 4).fault(room));
            let mixed = "on both sides of a wall and without room for a second record";
            stats.push(Stat::counted(mixed, "faces", counts, 12).fault(room));
        }
        let faults = [
            ("light was not finite and counts as dark", "faces", "please report it"),
            ("fewer samples than requested", "faces", LOOPS_ENDED),
        ];
        for ((name, unit, advice), at) in faults.into_iter().zip([0, 4]) {
            stats.push(Stat::counted(name, unit, &of.faults, at).fault(advice));
        }
        for volume in self.deposit.iter().flat_map(DepositPass::volumes) {
            let counters = volume.accumulators();
            let at = |head: u32| 4 * u64::from(head);
            stats.extend([
                Stat::counted(
                    "injected light was not finite",
                    "samples",
                    counters,
                    at(HEAD_REJECTED),
                )
                .fault("please report it"),
                Stat::counted("injected light was clamped", "samples", counters, at(HEAD_CLAMPED))
                    .fault("a light is nearer to a surface than half a voxel: use more voxels"),
                Stat::counted("injected outside the voxels", "samples", counters, at(HEAD_OUTSIDE)),
                Stat::counted("injected rays not traced", "rays", counters, at(HEAD_CUT))
                    .fault(LOOPS_ENDED),
            ]);
        }
        stats
    }

    /// Records one frame of light: voxelizes what has moved, then updates every face. If the scene has changed since
    /// the last update ([`Revisions`]), light gathered before the change counts less.
    ///
    /// # Errors
    /// The scene differs from the one that this was made for, or rays should start at the camera and the eye has none.
    /// In that case nothing useful is recorded.
    pub fn update(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        eye: &Eye,
    ) -> Result<(), VoxelLightError> {
        check_shaders(&self.shaders, scene)?;
        if self.settings.bounces == Bounces::UpTo(0) {
            return Ok(());
        }
        let pending = self.notice(scene.revisions());
        let shifts = self.follow(recorder, eye.position);
        let n_points = self.settings.points_per_face;
        let learning = |frames: u32| frames.saturating_sub(FRAMES_WITHOUT_HISTORY - 1).max(1);
        let light_frames = learning(self.frames_since_change);
        let light_rays = light_frames.saturating_mul(n_points);
        let moving_rays = learning(self.frames_since_motion).saturating_mul(n_points);
        let max_rays = self.settings.max_rays.min(moving_rays.max(RAYS_WHILE_MOVING));
        self.new_levels = std::array::from_fn(|ix| {
            ix < self.levels.len() && (pending.is_some() || shifts[ix] != IVec3::ZERO)
        });
        if self.frames_since_change == 0 || self.has_new_structure() {
            self.convergence.restart(recorder);
            self.convergence.copy_is_settled(recorder, &self.buffers.levels, IS_SETTLED_AT);
        }
        if self.has_new_structure() {
            if let Err(error) = self.voxelize(recorder, scene, pending, &shifts) {
                self.seen = None;
                return Err(error);
            }
            // What bounces look up still has the former order.
            self.publish(recorder, light_rays as f32);
        }
        if let Some(deposit) = &self.deposit {
            let seed = self.settings.seed.wrapping_add(self.n_frames);
            let light_frames = light_frames.min(self.settings.max_rays);
            deposit.record(recorder, scene, eye, &self.buffers, seed, light_frames)?;
        }
        {
            let pass = &mut recorder.compute("voxel_light/gather");
            for level in 0..self.layout.n_levels {
                let info = GatherInfo {
                    frame: self.n_frames,
                    seed: self.settings.seed,
                    n_points,
                    n_bounces: match self.settings.bounces {
                        _ if !self.settings.finds_reflected => 0,
                        Bounces::UpTo(n) => n,
                        Bounces::Unlimited => 1,
                    },
                    light_rays: light_rays as f32,
                    max_rays: max_rays as f32,
                    level,
                    finds_direct: u32::from(self.deposit.is_none()),
                };
                self.gather.record(pass, scene, &self.buffers, &info, self.buffers.records(level));
            }
        }
        self.publish(recorder, light_rays as f32);
        self.n_frames += 1;
        self.frames_since_change = self.frames_since_change.saturating_add(1);
        self.frames_since_motion = self.frames_since_motion.saturating_add(1);
        Ok(())
    }

    /// Compares the light that pictures see, once a frame, with what it was. `light`: [`CacheBuffers::shown`] or
    /// [`CacheBuffers::reflected`].
    pub fn compare(&mut self, recorder: &mut Recorder, light: fn(&CacheBuffers) -> &wgpu::Buffer) {
        let Self { convergence, buffers, .. } = self;
        convergence.record(recorder, light(buffers), &buffers.counts);
        convergence.copy_is_settled(recorder, &buffers.levels, IS_SETTLED_AT);
    }

    /// How much of that light is still on its way ([`Convergence::to_come`]).
    pub fn to_come(&self) -> Stat {
        self.convergence.to_come()
    }

    /// Which triangles to voxelize, given what has changed since the last update.
    fn notice(&mut self, now: Revisions) -> Option<Triangles> {
        let before = self.seen.replace(now);
        let is_same = |of: fn(&Revisions) -> u64| before.as_ref().map(of) == Some(of(&now));
        let moved = match (is_same(|r| r.geometry), is_same(|r| r.moving)) {
            (false, _) => Some(Triangles::All),
            (true, false) => Some(Triangles::Moving),
            (true, true) => None,
        };
        if before != Some(now) {
            self.frames_since_change = 0;
        }
        if moved.is_some() {
            self.frames_since_motion = 0;
        }
        moved
    }

    /// Moves the levels whose middle the eye has left, by whole cells; returns how far each moved. The last one is the
    /// whole scene's and stays.
    fn follow(&mut self, recorder: &mut Recorder, eye: Vec3) -> [IVec3; MAX_LEVELS as usize] {
        let mut shifts = [IVec3::ZERO; MAX_LEVELS as usize];
        let n_following = self.levels.len() - 1;
        let levels = self.levels[..n_following].iter_mut().zip(&mut self.layout.levels);
        for (ix, ((level, entry), shift)) in levels.zip(&mut shifts).enumerate() {
            let corner = corner_around(eye, &entry.grid);
            *shift = corner - level.corner;
            if *shift != IVec3::ZERO {
                level.corner = corner;
                entry.grid.origin = corner.as_vec3() * entry.grid.cell;
                level.voxelizer.move_to(entry.grid.origin);
                if let Some(deposit) = &mut self.deposit {
                    deposit.move_level(ix, entry.grid.origin);
                }
            }
        }
        if shifts != [IVec3::ZERO; MAX_LEVELS as usize] {
            recorder.upload(&self.buffers.levels, 0, bytemuck::bytes_of(&self.layout));
        }
        shifts
    }

    /// Records what bounces and pictures look up.
    fn publish(&self, recorder: &mut Recorder, light_rays: f32) {
        // Reflected light is new in each frame; with a limit, bounces begin with direct light alone in each frame.
        let is_kept = !self.settings.finds_reflected && self.settings.bounces == Bounces::Unlimited;
        let pass = &mut recorder.compute("voxel_light/publish");
        for level in 0..self.layout.n_levels {
            let info = PublishInfo {
                level,
                feedback: u32::from(self.settings.bounces == Bounces::Unlimited),
                light_rays,
                frame: if is_kept { self.n_frames } else { 0 },
            };
            self.publish.record(pass, &self.buffers, &info, self.buffers.records(level));
        }
    }

    /// Records new structures, and carrying the light over into them.
    fn voxelize(
        &mut self,
        recorder: &mut Recorder,
        scene: &dyn SceneSeam,
        pending: Option<Triangles>,
        shifts: &[IVec3],
    ) -> Result<(), VoxelLightError> {
        for (now, before) in [
            (&self.buffers.structure, &self.buffers.structure_before),
            (&self.buffers.lights, &self.buffers.lights_before),
        ] {
            recorder.encoder().copy_buffer_to_buffer(now, 0, before, 0, now.size());
        }
        for (ix, level) in self.levels.iter().enumerate() {
            let triangles = if shifts[ix] == IVec3::ZERO { pending } else { Some(Triangles::All) };
            let Some(triangles) = triangles else { continue };
            let voxelizer = &level.voxelizer;
            voxelizer.record(recorder, scene, triangles)?;
            let to = u64::from(self.layout.levels[ix].first_brick) * 8;
            let n_words = n_bricks(voxelizer.grid()) + voxelizer.grid().capacity;
            let (structure, counts) = (&self.buffers.structure, &self.buffers.counts[ix]);
            let encoder = recorder.encoder();
            let bytes = u64::from(n_words) * 8;
            encoder.copy_buffer_to_buffer(voxelizer.structure(), 0, structure, to, bytes);
            encoder.copy_buffer_to_buffer(voxelizer.counts(), 0, counts, 0, counts.size());
        }
        if let Some(sides) = &self.sides {
            let pass = &mut recorder.compute("voxel_light/sides");
            // (The others have their second records.)
            for (level, of_level) in
                (0..).zip(&self.levels).filter(|&(ix, _)| self.new_levels[ix as usize])
            {
                sides.record(pass, scene, &self.buffers, level, of_level.records());
            }
        }
        let pass = &mut recorder.compute("voxel_light/carry");
        for (level, &shift) in (0..self.layout.n_levels).zip(shifts) {
            let info = CarryInfo { shift, level };
            self.carry.record(pass, &self.buffers, &info, self.buffers.records(level));
        }
        Ok(())
    }
}

const NO_LEVEL: VoxelLevel = VoxelLevel {
    grid: VoxelGrid {
        origin: Vec3::ZERO,
        cell: 1.0,
        size: UVec3::ONE,
        n_faces: 1,
        bricks: UVec3::ONE,
        capacity: 0,
    },
    first_brick: 0,
    first_record: 0,
    first_side: 0,
    reserved: 0,
};
