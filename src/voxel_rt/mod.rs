//! `voxel-rt`: ray-traced voxel global illumination.
//!
//! Irradiance is kept for the faces of the voxels that surfaces stand in. Every frame renews it with a
//! few rays a face, independently of the picture's size; pixels look it up. The method is described
//! in `docs/techniques/voxel-rt.md`.
//!
//! ```text
//! Voxelizer ──structure──▶ CarryPass ──▶ GatherPass (every frame) ──▶ ShadePass
//!  when something moved     keeps what     rays from the faces of       G-buffer → indirect
//!  or the grid scrolled     is known       voxels; then PublishPass     radiance
//! ```
//!
//! Faces find their direct light themselves; or, as in the source, [`VoxelInjector`] deposits it by rays
//! from lights or the camera ([`DirectLight`]) with one of four [`WriteStrategy`]s, ahead of the gathering.

mod cache;
mod carry;
mod deposit;
mod gather;
mod inject;
mod levels;
mod publish;
mod settings;
mod shade;
mod structure;
mod walls;
mod write;

use crate::bindings::baseline::lucerna::voxel::levels::{VoxelLevel, VoxelLevels};
use crate::frame::{Frame, GBuffer, Technique};
use crate::gpu::{Gpu, GpuError};
use crate::gpu_scene::GpuScene;
use crate::shadow::ShadowMaps;
use crate::voxel::{
    RECORD_GROUPS_OFFSET, Resolution, Triangles, VOXEL_GROUPS_OFFSET, VoxelError, VoxelGrid,
    Voxelizer, n_bricks,
};
use glam::{IVec3, UVec3, Vec3};
use levels::{MAX_LEVELS, corner_around};

pub use crate::bindings::baseline::kernels::voxel_rt::inject::{RUN_SIDE, VoxelSample};
pub use crate::bindings::baseline::lucerna::voxel_rt::cache::FaceLight;
pub use cache::CacheBuffers;
pub(crate) use cache::LevelPass;
pub use carry::{CarryInfo, CarryPass};
pub use deposit::{DepositInfo, DepositPass};
pub use gather::{GatherInfo, GatherPass};
pub use inject::{Injection, InjectionSource, VoxelInjector};
pub use levels::VoxelReach;
pub use publish::{PublishInfo, PublishPass};
pub use settings::{Bounces, DirectLight, Levels, Lookup, RaysInjected, VoxelRtSettings};
pub use shade::ShadePass;
pub use structure::sparse_grid;
pub use walls::{WallsInfo, WallsPass};
pub use write::{InjectError, RejectedSamples, VoxelIrradiance, WriteStrategy};

/// `voxel-rt` could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum VoxelRtError {
    /// A setting is out of range.
    #[error("{name} is {value}; possible is {possible}")]
    Setting {
        /// Which.
        name: &'static str,
        /// What was given.
        value: String,
        /// What may be given.
        possible: &'static str,
    },
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

/// What has changed since the frame before; what was learned from then on counts less.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// Lights, emission or the sky.
    Light,
    /// Triangles have moved: those of instances that are marked as moving.
    Moving,
    /// Any triangles have moved.
    Geometry,
}

/// Rays that a face remembers of what stands in its cell while things move.
const RAYS_WHILE_MOVING: u32 = 8;

/// Frames after a change in which nothing older than a frame counts: light that is reflected again and
/// again needs as many to arrive.
const FRAMES_WITHOUT_HISTORY: u32 = 4;

/// The technique: voxels of a scene and the light that their faces receive.
#[derive(Debug)]
pub struct VoxelRt {
    settings: VoxelRtSettings,
    levels: Vec<Level>,
    layout: VoxelLevels,
    buffers: CacheBuffers,
    /// None: faces find their direct light themselves.
    deposit: Option<DepositPass>,
    gather: GatherPass,
    carry: CarryPass,
    walls: WallsPass,
    publish: PublishPass,
    shade: ShadePass,
    /// What is to be voxelized before the next frame.
    pending: Option<Triangles>,
    frames_since_change: u32,
    frames_since_motion: u32,
    n_frames: u32,
    /// Something else renews reflected light ([`VoxelRt::for_others`]).
    reflects_elsewhere: bool,
    has_new_structure: bool,
    reach: VoxelReach,
}

/// One grid.
#[derive(Debug)]
struct Level {
    voxelizer: Voxelizer,
    /// Cell of the world's grid of this size at which the level begins, if it follows the eye.
    corner: IVec3,
}

impl VoxelRt {
    /// Makes the buffers and compiles the kernels, for scenes of the same variant and bounds.
    ///
    /// `eye` \[m\]: where the camera stands. The levels are laid out for what can be seen from there.
    ///
    /// # Errors
    /// [`VoxelRtError`]: a setting is out of range, or a buffer is larger than the device binds.
    pub fn new(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelRtSettings,
        eye: Vec3,
    ) -> Result<Self, VoxelRtError> {
        Self::with_resolution(gpu, scene, settings, Resolution::Longest(settings.resolution), eye)
    }

    /// As [`Self::new`]; `resolution` is that of the coarsest grid, in the place of the settings'.
    fn with_resolution(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelRtSettings,
        resolution: Resolution,
        eye: Vec3,
    ) -> Result<Self, VoxelRtError> {
        settings.check()?;
        let n_faces = if settings.anisotropic { 6 } else { 1 };
        let limit = gpu.device.limits().max_storage_buffer_binding_size;
        let (grids, reach) = levels::grids(scene, &settings, resolution, n_faces, limit, eye)?;
        let mut layout = VoxelLevels {
            levels: [NO_LEVEL; MAX_LEVELS as usize],
            n_levels: grids.len() as u32,
            reserved_a: 0,
            reserved_b: 0,
            reserved_c: 0,
        };
        let (mut n_words, mut n_records) = (0, 0);
        let mut levels = Vec::new();
        for (level, (grid, corner)) in grids.into_iter().enumerate() {
            layout.levels[level] =
                VoxelLevel { grid, first_brick: n_words, first_record: n_records, ..NO_LEVEL };
            n_words += n_bricks(&grid) + grid.capacity;
            n_records += grid.capacity * n_faces;
            levels.push(Level { voxelizer: Voxelizer::new(gpu, scene, grid)?, corner });
        }
        let buffers = CacheBuffers::new(gpu, &layout, n_words, n_records)?;
        let voxelizers = levels.iter().map(|level| &level.voxelizer);
        let deposit = DepositPass::new(gpu, scene, &buffers, settings.direct, voxelizers)?;
        Ok(Self {
            settings,
            levels,
            layout,
            deposit,
            gather: GatherPass::new(gpu, scene, &buffers),
            carry: CarryPass::new(gpu, &buffers),
            walls: WallsPass::new(gpu, &buffers),
            publish: PublishPass::new(gpu, &buffers),
            shade: ShadePass::new(gpu, &buffers, settings.lookup),
            buffers,
            pending: Some(Triangles::All),
            frames_since_change: 0,
            frames_since_motion: 0,
            n_frames: 0,
            reflects_elsewhere: false,
            has_new_structure: false,
            reach,
        })
    }

    /// Voxels with their direct light, for a technique that renews reflected light itself:
    /// [`renew`](Self::renew) leaves `indirect` and `feedback` of [`FaceLight`] as they are, and makes
    /// [`CacheBuffers::reflected`] of direct light and feedback (of direct light alone if bounces are counted).
    ///
    /// `shadows`: for direct light, in the place of rays; drawn ahead of it.
    pub(crate) fn for_others(
        gpu: &Gpu,
        scene: &GpuScene,
        settings: VoxelRtSettings,
        resolution: Resolution,
        shadows: Option<&ShadowMaps>,
        eye: Vec3,
    ) -> Result<Self, VoxelRtError> {
        let mut made = Self::with_resolution(gpu, scene, settings, resolution, eye)?;
        if let Some(maps) = shadows {
            made.gather = GatherPass::with_shadow_maps(gpu, scene, &made.buffers, maps);
        }
        Ok(Self { reflects_elsewhere: true, ..made })
    }

    /// The voxelizers, from the finest level to the coarsest.
    pub(crate) fn voxelizers(&self) -> impl Iterator<Item = &Voxelizer> {
        self.levels.iter().map(|level| &level.voxelizer)
    }

    /// Whether the last [`renew`](Self::renew) made a new structure: voxels have other places in memory.
    pub(crate) fn has_new_structure(&self) -> bool {
        self.has_new_structure
    }

    /// Updates so far.
    pub(crate) fn n_frames(&self) -> u32 {
        self.n_frames
    }

    /// Nested grids.
    pub fn n_levels(&self) -> usize {
        self.levels.len()
    }

    /// How fine the cells are for what stood around the eye when this was made, and what lies beyond them.
    pub fn reach(&self) -> &VoxelReach {
        &self.reach
    }

    /// What was chosen.
    pub fn settings(&self) -> &VoxelRtSettings {
        &self.settings
    }

    /// Where a level's cells stand.
    pub fn grid(&self, level: usize) -> &VoxelGrid {
        self.levels[level].voxelizer.grid()
    }

    /// What is kept between frames.
    pub fn buffers(&self) -> &CacheBuffers {
        &self.buffers
    }

    /// What rays from lights or the camera deposit; None where faces find their direct light themselves.
    pub fn deposit(&self) -> Option<&DepositPass> {
        self.deposit.as_ref()
    }

    /// Says what has changed since the last [`update`](Self::update). The history is given up, and
    /// what has moved is voxelized again.
    pub fn changed(&mut self, change: Change) {
        self.frames_since_change = 0;
        if change != Change::Light {
            self.frames_since_motion = 0;
        }
        self.pending = match (change, self.pending) {
            (Change::Light, pending) => pending,
            (Change::Geometry, _) | (_, Some(Triangles::All)) => Some(Triangles::All),
            (Change::Moving, _) => Some(Triangles::Moving),
        };
    }

    /// Records one frame of light: voxelizes what has moved, then renews every face. At most one
    /// update a submission: uniforms are written when it is submitted.
    ///
    /// # Errors
    /// The scene has another number of triangles than the one that this was made for.
    ///
    /// # Panics
    /// If the scene's variant is another.
    pub fn renew(&mut self, frame: &mut Frame) -> Result<(), VoxelRtError> {
        if self.settings.bounces == Bounces::UpTo(0) {
            return Ok(());
        }
        let (gpu, scene) = (frame.gpu, frame.scene);
        let shifts = self.follow(gpu, frame.view.data().camera.position);
        let n_points = self.settings.points_per_face;
        let learning = |frames: u32| frames.saturating_sub(FRAMES_WITHOUT_HISTORY - 1).max(1);
        let light_frames = learning(self.frames_since_change);
        let light_rays = light_frames.saturating_mul(n_points);
        let moving_rays = learning(self.frames_since_motion).saturating_mul(n_points);
        let max_rays = self.settings.max_rays.min(moving_rays.max(RAYS_WHILE_MOVING));
        self.has_new_structure =
            self.pending.is_some() || shifts.iter().any(|&shift| shift != IVec3::ZERO);
        if self.has_new_structure {
            self.voxelize(frame, &shifts)?;
            // What bounces look up stands by the places of before.
            self.publish_light(frame, light_rays as f32);
        }
        if let Some(deposit) = &self.deposit {
            let voxelizers = self.levels.iter().map(|level| &level.voxelizer);
            let seed = self.settings.seed.wrapping_add(self.n_frames);
            let light_frames = light_frames.min(self.settings.max_rays);
            deposit.record(frame, voxelizers, seed, light_frames)?;
        }
        {
            let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some("voxel_rt/gather"),
                timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/gather")),
            });
            for (level, of_level) in (0..).zip(&self.levels) {
                let info = GatherInfo {
                    frame: self.n_frames,
                    seed: self.settings.seed,
                    n_points,
                    n_bounces: match self.settings.bounces {
                        _ if self.reflects_elsewhere => 0,
                        Bounces::UpTo(n) => n,
                        Bounces::Unlimited => 1,
                    },
                    light_rays: light_rays as f32,
                    max_rays: max_rays as f32,
                    level,
                    finds_direct: u32::from(self.deposit.is_none()),
                };
                let arguments = (of_level.voxelizer.counts(), RECORD_GROUPS_OFFSET);
                self.gather.record(gpu, &mut pass, scene, &info, arguments);
            }
        }
        self.publish_light(frame, light_rays as f32);
        self.n_frames += 1;
        self.frames_since_change = self.frames_since_change.saturating_add(1);
        self.frames_since_motion = self.frames_since_motion.saturating_add(1);
        Ok(())
    }
}

impl VoxelRt {
    /// Moves the levels that the eye has left the middle of, by whole cells; how far each moved. The last
    /// one is the whole scene's and stays.
    fn follow(&mut self, gpu: &Gpu, eye: Vec3) -> [IVec3; MAX_LEVELS as usize] {
        let mut shifts = [IVec3::ZERO; MAX_LEVELS as usize];
        let n_following = self.levels.len() - 1;
        let levels = self.levels[..n_following].iter_mut().zip(&mut self.layout.levels);
        for (ix, ((level, entry), shift)) in levels.zip(&mut shifts).enumerate() {
            let corner = corner_around(eye, &entry.grid);
            *shift = corner - level.corner;
            if *shift != IVec3::ZERO {
                level.corner = corner;
                entry.grid.origin = corner.as_vec3() * entry.grid.cell;
                level.voxelizer.move_to(gpu, entry.grid.origin);
                if let Some(deposit) = &mut self.deposit {
                    deposit.move_level(gpu, ix, entry.grid.origin);
                }
            }
        }
        if shifts != [IVec3::ZERO; MAX_LEVELS as usize] {
            gpu.queue.write_buffer(&self.buffers.levels, 0, bytemuck::bytes_of(&self.layout));
        }
        shifts
    }

    /// Notes the walls and makes what bounces and pictures look up. (Uniforms hold the last call's settings; a
    /// frame's calls agree.)
    fn publish_light(&self, frame: &mut Frame, light_rays: f32) {
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/publish"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/publish")),
        });
        for (level, of_level) in (0..).zip(&self.levels) {
            let info = WallsInfo { level, reserved_a: 0, reserved_b: 0, reserved_c: 0 };
            let arguments = (of_level.voxelizer.counts(), VOXEL_GROUPS_OFFSET);
            self.walls.record(frame.gpu, &mut pass, &info, arguments);
            let info = PublishInfo {
                level,
                feedback: u32::from(self.settings.bounces == Bounces::Unlimited),
                light_rays,
                reserved: 0,
            };
            let arguments = (of_level.voxelizer.counts(), RECORD_GROUPS_OFFSET);
            self.publish.record(frame.gpu, &mut pass, &info, arguments);
        }
    }

    /// Records new structures and carries the light into them.
    fn voxelize(&mut self, frame: &mut Frame, shifts: &[IVec3]) -> Result<(), VoxelRtError> {
        let (gpu, scene) = (frame.gpu, frame.scene);
        let pending = self.pending;
        for (now, before) in [
            (&self.buffers.structure, &self.buffers.structure_before),
            (&self.buffers.lights, &self.buffers.lights_before),
        ] {
            frame.encoder.copy_buffer_to_buffer(now, 0, before, 0, now.size());
        }
        for (ix, level) in self.levels.iter().enumerate() {
            let triangles = if shifts[ix] == IVec3::ZERO { pending } else { Some(Triangles::All) };
            if let Some(triangles) = triangles {
                let written = frame.timers.as_mut().and_then(|t| t.compute("voxel/voxelize"));
                level.voxelizer.record(frame.encoder, scene, triangles, written)?;
                let from = level.voxelizer.structure();
                let to = u64::from(self.layout.levels[ix].first_brick) * 8;
                let bytes =
                    u64::from(n_bricks(level.voxelizer.grid()) + level.voxelizer.grid().capacity)
                        * 8;
                frame.encoder.copy_buffer_to_buffer(from, 0, &self.buffers.structure, to, bytes);
                frame.encoder.copy_buffer_to_buffer(
                    level.voxelizer.counts(),
                    0,
                    &self.buffers.counts[ix],
                    0,
                    16,
                );
            }
        }
        let mut pass = frame.encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("voxel_rt/carry"),
            timestamp_writes: frame.timers.as_mut().and_then(|t| t.compute("voxel_rt/carry")),
        });
        for (ix, level) in self.levels.iter().enumerate() {
            let info = CarryInfo { shift: shifts[ix], level: ix as u32 };
            let arguments = (level.voxelizer.counts(), VOXEL_GROUPS_OFFSET);
            self.carry.record(gpu, &mut pass, &info, arguments);
        }
        drop(pass);
        self.pending = None;
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
    reserved_a: 0,
    reserved_b: 0,
};

impl Technique for VoxelRt {
    type Error = VoxelRtError;

    fn update(&mut self, frame: &mut Frame) -> Result<(), VoxelRtError> {
        self.renew(frame)
    }

    fn shade(&mut self, frame: &mut Frame, gbuffer: &GBuffer) -> Option<wgpu::TextureView> {
        if self.settings.bounces == Bounces::UpTo(0) {
            return None;
        }
        Some(self.shade.record(frame, gbuffer))
    }
}
